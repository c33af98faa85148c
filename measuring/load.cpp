// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/load.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/temporary.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {
namespace {

[[noreturn]] void burn_cpu() {
  std::vector<unsigned> memory(2 << 20);
  for (unsigned i = 0;; ++i) {
    for (std::size_t at = 0; at < memory.size(); at += 16) memory[at] = memory[at] * 31 + i;
    asm volatile("" ::"r"(memory.data()) : "memory");
  }
}

[[noreturn]] void write_files() {
  const std::vector<char> block(1 << 20, 'x');
  for (;;) {
    const int file = temporary_file();
    if (file < 0) _exit(1);
    for (int i = 0; i < 4; ++i) {
      if (write(file, block.data(), block.size()) < 0) break;
    }
    fsync(file);
    close(file);
  }
}

}  // namespace

const std::vector<std::string>& load_names() {
  static const std::vector<std::string> names{"cpu", "io", "none"};
  return names;
}

Load::Load(const std::string& kind) {
  if (std::find(load_names().begin(), load_names().end(), kind) == load_names().end()) {
    throw Error("there is no load '" + kind + "'", suggest(kind, load_names()));
  }
  const std::size_t count = kind == "cpu" ? available_cpus().size() : kind == "io" ? 2 : 0;
  const pid_t parent = getpid();
  for (std::size_t i = 0; i < count; ++i) {
    const pid_t child = fork();
    if (child < 0) throw Error("cannot create a load process: " + errno_message(errno));
    if (child > 0) {
      processes_.push_back(child);
      continue;
    }
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(0);
    signal(SIGINT, SIG_IGN);  // the measuring process ends this one
    apply({.name = "load",
           .affinity = kind == "cpu" ? std::vector{available_cpus()[i]} : std::vector<int>{}},
          Realtime::prefer);
    if (kind == "cpu") burn_cpu();
    write_files();
  }
}

Load::~Load() {
  for (const pid_t process : processes_) kill(process, SIGKILL);
  for (const pid_t process : processes_) waitpid(process, nullptr, 0);
}

}  // namespace takt::rt
