// SPDX-License-Identifier: Apache-2.0
#include "run/program.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/measuring/json_text.hpp"

#include "exit_status.hpp"
#include "run/end_signals.hpp"
#include "run/live_line.hpp"
#include "run/progress.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

// Limit: bytes of the results of a program. At it: they are refused. Seen: the error.
constexpr std::size_t kMostBytes = std::size_t{4} << 30;

/// The program may change its folder.
std::string absolute_path(const std::string& file) {
  return file.empty() ? "" : std::filesystem::absolute(file).string();
}

/// What is to be preloaded; `what` needs it.
std::string part_of_takt(const char* name, const char* what) {
  const auto library = path_of_takt().parent_path() / "takt" / name;
  if (!std::filesystem::exists(library)) {
    throw Error(fmt::format("{}: there is no library '{}'", what, library.string()),
                "install Takt whole, or leave the option out");
  }
  return library.string();
}

std::string preloaded(const ProgramRun& run) {
  if (run.counts_allocations) return part_of_takt("libtakt_allocations.so", "--allocations");
  return run.simulated.empty() ? "" : part_of_takt("libtakt_simulated.so", "-- PROGRAM");
}

struct Start {
  const std::vector<std::string>& words;
  std::vector<std::pair<const char*, std::string>> variables;  // those that are not empty are set
  bool has_stdout;
  bool keeps_others = true;  // variables of Takt that somebody has set
};

/// Does not return. Writes errno to the descriptor if it cannot be started.
[[noreturn]] void become(const Start& start, pid_t parent, int failure) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(1);  // it has died before
  setpgid(0, 0);
  EndSignals::let_through();
  // Reading from the terminal would stop it, as its group is not the one in the foreground.
  if (isatty(STDIN_FILENO) != 0) dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  if (!start.has_stdout) dup2(STDERR_FILENO, STDOUT_FILENO);
  // What somebody else has asked for is not what we do.
  for (const char* name :
       {"TAKT_RESULTS", "TAKT_TRACE", "TAKT_NODES", "TAKT_CONFIG_TEMPLATE", "TAKT_SIMULATE"}) {
    unsetenv(name);
  }
  for (const auto& [name, value] : start.variables) {
    if (!value.empty()) setenv(name, value.c_str(), /*overwrite=*/1);
    if (value.empty() && !start.keeps_others) unsetenv(name);
  }
  std::vector<std::string> words = start.words;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv.front(), argv.data());
  const int error = errno;
  _exit(write(failure, &error, sizeof error) == sizeof error ? 127 : 126);
}

pid_t begin(const Start& start) {
  std::array<int, 2> failure{};
  if (pipe2(failure.data(), O_CLOEXEC) != 0) {
    throw Error("cannot create a pipe: " + errno_message(errno));
  }
  const pid_t parent = getpid(), child = fork();
  if (child == 0) become(start, parent, failure[1]);
  const int fork_error = errno;
  close(failure[1]);
  int error = 0;
  const bool has_failed =
      child > 0 && read(failure[0], &error, sizeof error) == static_cast<ssize_t>(sizeof error);
  close(failure[0]);
  if (child < 0) throw Error("cannot create a process: " + errno_message(fork_error));
  if (!has_failed) return child;
  waitpid(child, nullptr, 0);
  throw Error(fmt::format("the program '{}' cannot be started: {}", start.words.front(),
                          errno_message(error)),
              "give its path after --, or start it with `takt ros2 run`");
}

struct Ended {
  int signal = 0;          // that has ended the run before its time; 0: none
  int status = 0;          // of the program
  std::string why_killed;  // empty: it has ended by itself
};

/// Of what the program has left behind: it may be about to write the results.
void wait_for_group(pid_t group) {
  kill(-group, SIGINT);
  const TimePoint limit = later(Clock::steady().now(), kHurriedEndLimit);
  while (kill(-group, 0) == 0 && Clock::steady().now() < limit) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(-group, SIGKILL);
}

Ended wait_for_end(pid_t child, Nanoseconds duration, const EndSignals& signals) {
  const auto process = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  if (process < 0) throw Error("cannot observe the program: " + errno_message(errno));
  Ended ended;
  {
    Progress progress(duration);
    TimePoint limit = progress.end();
    bool is_ending = false;
    std::array<pollfd, 2> events{{{process, POLLIN, 0}, {signals.fd(), POLLIN, 0}}};
    while (events[0].revents == 0) {
      const TimePoint now = Clock::steady().now();
      const int taken = signals.take();
      if (taken != 0 || now >= limit) {
        if (is_ending) {
          ended.why_killed =
              taken != 0 ? fmt::format("by a second signal, {}", name_of_signal(taken))
                         : fmt::format("as it had not ended within {} s of {}", kEndLimit.count(),
                                       name_of_signal(ended.signal == 0 ? SIGINT : ended.signal));
        } else {
          ended.signal = taken;
        }
        kill(-child, is_ending ? SIGKILL : taken != 0 ? taken : SIGINT);
        is_ending = true;
        limit = later(now, kEndLimit);
      }
      const timespec time =
          to_timespec(is_ending ? between(now, limit) : std::min(progress.show(now), limit - now));
      ppoll(events.data(), events.size(), &time, nullptr);
    }
  }
  close(process);
  waitpid(child, &ended.status, 0);
  wait_for_group(child);
  return ended;
}

/// Why it has failed; empty: it has not.
std::string failure_of(const Ended& ended, const std::string& program) {
  if (!ended.why_killed.empty()) {
    return fmt::format("the program '{}' was killed {}", program, ended.why_killed);
  }
  if (WIFSIGNALED(ended.status)) {
    return fmt::format("the program '{}' was ended by {}", program,
                       name_of_signal(WTERMSIG(ended.status)));
  }
  const int status = WEXITSTATUS(ended.status);
  return status == 0 ? "" : fmt::format("the program '{}' ended with status {}", program, status);
}

/// What the program has written; throws if it has not.
json read_written(const std::string& path, const char* key, const Ended& ended,
                  const std::string& program, const char* what) {
  std::error_code is_missing;  // it is empty from the start to the end of the program
  if (std::filesystem::file_size(path, is_missing) != 0 && !is_missing) {
    json written = rt::json_or_null(read_text(path, kMostBytes));
    if (written.is_object() && written.contains(key)) return written;
  }
  if (ended.signal != 0 && ended.why_killed.empty()) {
    throw Interrupted(ended.signal, " before the program had written its results");
  }
  const std::string failure = failure_of(ended, program);
  if (!failure.empty()) throw std::runtime_error(failure);
  throw Error(fmt::format("the program '{}' has {}", program, what),
              "give one that was built for rclcpp with `takt ros2 build`, and leave it its rights "
              "and a disk");
}

}  // namespace

ProgramResults results_of_program(const ProgramRun& run) {
  const EndSignals signals;  // lets no signal end this process before the folder has gone
  const TemporaryFolder folder;
  const std::string results = folder / "results.json";
  const pid_t child =
      begin({run.words,
             {{"TAKT_RESULTS", results},
              {"TAKT_CONFIG", absolute_path(run.file)},
              {"TAKT_EXECUTOR", run.executor},
              {"TAKT_PLACEMENT", run.placement},
              {"TAKT_SCHEDULER", run.scheduler},
              {"TAKT_TRACE", run.trace_events == 0 ? "" : std::to_string(run.trace_events)},
              {"TAKT_SIMULATE", run.simulated},
              {"LD_PRELOAD", preloaded(run)}},
             run.has_stdout,
             run.simulated.empty()});
  begin_work();
  const Ended ended = wait_for_end(child, run.duration, signals);
  const std::string failure = failure_of(ended, run.words.front());
  ProgramResults done{
      .written = read_written(results, "runs", ended, run.words.front(), "written no results"),
      .failed = {},
      .signal = ended.signal};
  if (!failure.empty()) done.failed.push_back(failure);
  return done;
}

FinishedRun run_program(const ProgramRun& run) {
  ProgramResults done = results_of_program(run);
  return {.run = rt::read_runs(done.written, "the program's results: ").at(0),
          .failed = std::move(done.failed),
          .signal = done.signal};
}

json nodes_of_program(const std::vector<std::string>& words, const std::string& file) {
  const EndSignals signals;
  const TemporaryFolder folder;
  const std::string nodes = folder / "nodes.json";
  const pid_t child =
      begin({words, {{"TAKT_NODES", nodes}, {"TAKT_CONFIG", absolute_path(file)}}, false});
  const Ended ended = [&] {
    const LiveLine line("waiting for the program to spin");
    return wait_for_end(child, kEndLimit, signals);
  }();
  check_complete(ended.signal, true);
  return read_written(nodes, "nodes", ended, words.front(), "not spun the nodes of the file");
}

}  // namespace takt::tools
