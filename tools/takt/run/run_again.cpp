// SPDX-License-Identifier: Apache-2.0
#include "run/run_again.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <set>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "run/child_output.hpp"

namespace takt::tools {

namespace {

/// Reads the child's output until it ends. Passes a signal on to the child; a second one kills it,
/// as does its time: one that is stopped takes no signal.
std::string output_of(pid_t child, int pipe, const EndSignals& signals, int& signal) {
  ChildOutput output(child, pipe);
  TimePoint limit = kNever;
  for (;;) {
    const TimePoint now = Clock::steady().now();
    if (!output.wait(between(now, std::min(limit, later(now, std::chrono::hours(1)))),
                     signals.fd())) {
      return output.text();
    }
    if (const int taken = signals.take(); taken != 0) {
      kill(child, signal == 0 ? taken : SIGKILL);
      signal = taken;
      limit = later(Clock::steady().now(), kEndLimit + kHurriedEndLimit);
    }
    if (Clock::steady().now() >= limit) kill(child, SIGKILL);
  }
}

/// What a child has written to the file last; -1: none.
std::string end_of(int file) {
  // Limit: bytes that are shown of what a run said that failed. At it: the last ones are shown.
  // Seen: the begin is missing.
  constexpr off_t kMostShown = 8192;
  if (file < 0) return {};
  std::string text(static_cast<std::size_t>(kMostShown), ' ');
  const off_t begin = std::max<off_t>(lseek(file, 0, SEEK_END) - kMostShown, 0);
  const ssize_t size = pread(file, text.data(), text.size(), begin);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return text;
}

/// Each note once: the same system runs many times.
void show_notes(const std::vector<std::string>& notes) {
  static std::set<std::string> shown;
  for (const std::string& note : notes) {
    if (!shown.insert(note).second) continue;
    if (isatty(STDERR_FILENO) != 0) rt::clear_line();
    rt::to_stderr("note: {}\n", note);
  }
}

}  // namespace

void become_takt(std::vector<std::string> words) {
  words.insert(words.begin(), "takt");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv("/proc/self/exe", argv.data());
  _exit(127);
}

void use_own_domain() {
  setenv("ROS_DOMAIN_ID", fmt::format("{}", 20 + getpid() % 80).c_str(), /*overwrite=*/0);
}

nlohmann::json run_again(std::vector<std::string> words, const EndSignals& signals, bool is_quiet) {
  // Its file, if it has one.
  const std::string of = words.size() > 1 && !words[1].starts_with('-') ? words[1] : "";
  const int kept = is_quiet ? temporary_file() : -1;
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0) {
    throw Error("cannot create a pipe: " + errno_message(errno));
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (child == 0) {
    // Over exec, too: no takt has capabilities of its own file, see decision 0085.
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);  // it has died before
    setpgid(0, 0);
    EndSignals::let_through();
    dup2(pipe_ends[1], STDOUT_FILENO);
    if (kept >= 0) dup2(kept, STDERR_FILENO);
    if (OutputFile::may_overwrite() && words.front() == "run") words.push_back("--force");
    unsetenv("TAKT_EXECUTOR");  // the words say which
    unsetenv("TAKT_PLACEMENT");
    unsetenv("TAKT_SCHEDULER");
    become_takt(std::move(words));
  }
  close(pipe_ends[1]);
  int signal = 0;
  const std::string text = output_of(child, pipe_ends[0], signals, signal);
  int status = 0;
  waitpid(child, &status, 0);
  const std::string said = end_of(kept);
  if (kept >= 0) close(kept);
  if (signal != 0) throw Interrupted(signal, "");
  // A simulation says so when a chain has missed its deadline, and writes its result.
  if (words.front() == "simulate" && WIFEXITED(status) && WEXITSTATUS(status) == kFailed)
    status = 0;
  if (status != 0) rt::to_stderr("{}", said);
  if (WIFSIGNALED(status)) {  // it may have said nothing
    throw Error(
        fmt::format("a run was ended by signal {} ({})", WTERMSIG(status),
                    sigdescr_np(WTERMSIG(status))),
        WTERMSIG(status) == SIGKILL
            ? "so ends who exceeds a limit of CPU time (`ulimit -t`), or takes the last memory"
            : "please report it",
        of);
  }
  if (status != 0) {
    const std::string what = fmt::format("a run ended with status {}", WEXITSTATUS(status));
    const char* const hint = "see its message above";
    if (WEXITSTATUS(status) == kBadUsage) throw Refused(what, hint);
    throw Error(what, hint);
  }
  nlohmann::json result = rt::json_or_null(text);
  if (!result.is_object()) throw Error("a run has written no result", "see its message above");
  return result;
}

rt::Run run_once(std::vector<std::string> words, const EndSignals& signals, bool is_quiet) {
  rt::Run run = rt::read_runs(run_again(std::move(words), signals, is_quiet), "").at(0);
  show_notes(run.notes);
  return run;
}

}  // namespace takt::tools
