// SPDX-License-Identifier: Apache-2.0
#include "run/run_again.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <set>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {

namespace {

/// Reads the child's output until its end. Passes a signal on to the child; a second one kills it.
std::string output_of(pid_t child, int pipe, const EndSignals& signals, int& signal) {
  std::string text;
  std::array<char, 65536> buffer;
  for (;;) {
    std::array<pollfd, 2> events{{{pipe, POLLIN, 0}, {signals.fd(), POLLIN, 0}}};
    poll(events.data(), events.size(), -1);
    if (const int taken = signals.take(); taken != 0) {
      kill(child, signal == 0 ? taken : SIGKILL);
      signal = taken;
    }
    if (events[0].revents == 0) continue;
    const ssize_t size = read(pipe, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(size));
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
void show_notes(const nlohmann::json& notes) {
  static std::set<std::string> shown;
  for (const nlohmann::json& note : notes) {
    if (!shown.insert(note.get<std::string>()).second) continue;
    if (isatty(STDERR_FILENO) != 0) rt::clear_line();
    rt::to_stderr("note: {}\n", note.get<std::string>());
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
    signals.let_through();
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
  close(pipe_ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  const std::string said = end_of(kept);
  if (kept >= 0) close(kept);
  if (signal != 0) throw Interrupted(signal, "");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    rt::to_stderr("{}", said);
    throw Error(fmt::format("a run ended with status {}",
                            WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status)),
                "see its message above");
  }
  nlohmann::json result = nlohmann::json::parse(text);
  if (result.contains("runs")) {
    for (const nlohmann::json& run : result.at("runs")) show_notes(run.at("notes"));
  }
  return result;
}

}  // namespace takt::tools
