// A component that leaves traces in the directory $WITNESS, for signals_test.py: its constructor
// and destructor each append a line to a file of its name, its timer a byte. While there is a FIFO
// NAME.gate, the constructor waits until somebody opens it; so does the timer, at NAME.jam. While
// there is a file NAME.exit, the constructor ends the process, and a child of it goes on; while
// there is one NAME.helper, it starts a process that keeps all that is open, and writes without an
// end.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "takt/containers/component.hpp"

namespace {

using namespace std::chrono_literals;

class Witness : public takt::Node {
 public:
  explicit Witness(const takt::NodeOptions& options) : Node("witness", options) {
    leave("entered", "\n");
    wait_at("gate");
    if (std::filesystem::exists(path("exit"))) {
      if (fork() == 0) {
        for (int file = 0; file < 3; ++file) close(file);
        alarm(20);
        for (;;) pause();
      }
      std::exit(0);
    }
    if (std::filesystem::exists(path("helper")) && fork() == 0) {
      alarm(60);
      for (;;) {
        if (write(STDERR_FILENO, "help\n", 5) != 5) pause();
        usleep(1000);
      }
    }
    leave("made", "\n");
    timer_ = create_timer("tick", 5ms, [this] {
      leave("ticks", ".");
      wait_at("jam");
    });
  }
  ~Witness() override { leave("gone", "\n"); }

 private:
  std::string path(const char* what) const {
    return std::string(std::getenv("WITNESS")) + "/" + name() + "." + what;
  }
  void wait_at(const char* what) const {
    if (std::filesystem::exists(path(what))) std::ifstream fifo(path(what));
  }
  void leave(const char* what, const char* text) const {
    std::ofstream(path(what), std::ios::app) << text;
  }

  std::shared_ptr<takt::Timer> timer_;
};

}  // namespace

TAKT_REGISTER_COMPONENT(Witness)
