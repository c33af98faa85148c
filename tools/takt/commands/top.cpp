// takt top: shows what running containers do now.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include "takt/base/logger.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/domain_option.hpp"
#include "prompt/values.hpp"
#include "run/end_signals.hpp"
#include "top/interval_json.hpp"
#include "top/screen.hpp"
#include "top/udp_stream.hpp"
#include "top/watch.hpp"

namespace takt::tools::top_command {
namespace {

using namespace std::chrono_literals;

struct Options {
  DomainOption domain;
  std::vector<std::string> containers;
  Nanoseconds interval = 1s;
  std::uint64_t count = 0;
  bool is_json = false;
  std::string stream;
};

/// Where it is shown.
class Display {
 public:
  virtual ~Display() = default;
  virtual void show(const std::vector<top::Watched>& containers) = 0;
  /// Keys may have been pressed. False: the user wants to end.
  virtual bool look() { return true; }
  virtual int fd() const { return -1; }
};

class JsonLines final : public Display {
 public:
  void show(const std::vector<top::Watched>& containers) override {
    rt::print("{}\n", rt::json_text(top::interval_json(containers)));
    rt::flush_output();
  }
};

/// The same lines, as datagrams.
class StreamedLines final : public Display {
 public:
  explicit StreamedLines(const std::string& address) : stream_(address) {}
  void show(const std::vector<top::Watched>& containers) override {
    stream_.send(rt::json_text(top::interval_json(containers)));
  }

 private:
  top::UdpStream stream_;
};

/// Keeps what is logged away from the tables, and logs it when they have gone.
class HeldLog {
 public:
  HeldLog() {
    Logger::instance().set_writer([this](LogLevel level, std::string_view line) {
      if (lines_.size() == kMost) lines_.pop_front();
      lines_.emplace_back(level, line);
    });
  }
  ~HeldLog() {
    Logger::instance().set_writer({});
    for (const auto& [level, line] : lines_) log(level, "{}", line);
  }
  HeldLog(const HeldLog&) = delete;
  HeldLog& operator=(const HeldLog&) = delete;

 private:
  // Limit: log lines that takt top keeps while it shows tables. At it: the oldest goes. Seen:
  // nothing.
  static constexpr std::size_t kMost = 100;
  std::deque<std::pair<LogLevel, std::string>> lines_;  // the log's thread writes it
};

class LiveTables final : public Display {
 public:
  LiveTables() : view_(screen_.has_blocks()) { screen_.draw(view_); }
  void show(const std::vector<top::Watched>& containers) override {
    view_.show(containers);
    screen_.draw(view_);
  }
  bool look() override {
    bool was_pressed = false;
    while (const auto key = screen_.key()) {
      was_pressed = true;
      if (!view_.press(*key)) return false;
    }
    if (was_pressed) screen_.draw(view_);
    return true;
  }
  int fd() const override { return STDIN_FILENO; }

 private:
  const HeldLog log_;  // until after the screen
  top::Screen screen_;
  top::View view_;
};

/// Waits for keys and signals until something has come true.
class Session {
 public:
  Session(const EndSignals& signals, Display& display) : signals_(signals), display_(display) {}

  /// Until the time, or until `is_enough`. Returns false if the user wants to end, or the terminal
  /// is lost, also where SIGHUP is ignored.
  template <class Condition>
  bool wait_until(TimePoint limit, Condition&& is_enough) {
    for (TimePoint now = Clock::steady().now(); now < limit && !is_enough();
         now = Clock::steady().now()) {
      std::array<pollfd, 2> events{{{signals_.fd(), POLLIN, 0}, {display_.fd(), POLLIN, 0}}};
      const Nanoseconds most = std::min<Nanoseconds>(limit - now, kLook);
      const timespec time{most / 1s, (most % 1s).count()};
      ppoll(events.data(), events.size(), &time, nullptr);
      signal_ = signals_.take();
      if (signal_ == 0 && (events[1].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) {
        signal_ = SIGHUP;
      }
      if (signal_ != 0 || !display_.look()) return false;
    }
    return true;
  }
  int signal() const noexcept { return signal_; }

 private:
  // How long an answer, and a new size of the window, may wait.
  static constexpr Nanoseconds kLook = 50ms;
  const EndSignals& signals_;
  Display& display_;
  int signal_ = 0;
};

// The first answers are only what the next ones are compared with.
void run(const Options& options) {
  const EndSignals signals(EndSignals::Command::looks);  // before any thread
  std::unique_ptr<Display> display;
  if (!options.stream.empty()) display = std::make_unique<StreamedLines>(options.stream);
  top::Watch watch(options.domain.number(), options.containers,
                   std::max<Nanoseconds>(2 * options.interval, 3s));
  const bool is_json = options.is_json || !options.stream.empty() || isatty(STDOUT_FILENO) == 0 ||
                       isatty(STDIN_FILENO) == 0;
  if (display == nullptr && is_json) {
    display = std::make_unique<JsonLines>();
  } else if (display == nullptr) {
    display = std::make_unique<LiveTables>();
  }
  Session session(signals, *display);
  const auto never = [] { return false; };
  const auto answered = [&] { return watch.has_answers(); };
  TimePoint next = Clock::steady().now();
  bool has_begun = false;
  for (std::uint64_t shown = 0;;) {
    watch.ask();
    next = later(next, options.interval);
    if (!session.wait_until(next, answered)) break;
    watch.take();
    if (has_begun || !is_json) display->show(watch.containers());
    if (has_begun && ++shown == options.count) return;
    has_begun = has_begun || watch.has_begun();
    if (!session.wait_until(next, never)) break;
    const TimePoint now = Clock::steady().now();
    if (later(next, options.interval) < now) next = now;  // it was stopped
  }
  display.reset();
  check_complete(session.signal(), /*ends_by_itself=*/options.count != 0);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("CONTAINER", options->containers,
                      "The containers' names (default: all containers)");
  add_time_option(*command, "-d,--interval", options->interval,
                  "Time between two looks (default: 1s)");
  whole_number(command->add_option("-n,--count", options->count,
                                   "End after this many intervals (default: until q or Ctrl-C)"),
               1, 1'000'000'000);
  command->add_flag("--json", options->is_json,
                    "Print one line of JSON each interval, as where the output is no terminal");
  command->add_option("--stream", options->stream,
                      "Send these lines there instead, for PlotJuggler: udp://HOST:PORT");
  options->domain.add_to(*command);
  command->footer(
      "Example:\n"
      "  takt top\n"
      "  takt top robot --interval 500ms\n"
      "  takt top --json --count 10\n"
      "  takt top robot --interval 100ms --stream udp://127.0.0.1:9870\n");
  command->callback([options] { run(*options); });
}
const Command registered("top", "Shows what running containers do now", set_up);

}  // namespace
}  // namespace takt::tools::top_command
