// SPDX-License-Identifier: Apache-2.0
#include "run/supervisor.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <csignal>
#include <cstdio>
#include <deque>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/measuring/output.hpp"

#include "exit_status.hpp"
#include "run/channel.hpp"
#include "run/child_output.hpp"
#include "run/progress.hpp"
#include "run/run_again.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

// After a child was killed, which may have held a lock in shared memory: a child that deletes an
// entity waits 3 s for it (delete_within_bound in transport/shared_memory/), and can end then.
constexpr auto kEndLimitAfterDeaths = 5s;

}  // namespace

/// Prints the output of a process line by line, with the process's name.
class Output {
 public:
  ~Output() { set(-1); }
  /// Of which a read does not wait.
  void set(int fd) {
    if (fd_ >= 0) close(fd_);
    fd_ = fd;
  }
  int fd() const noexcept { return fd_; }
  /// Takes some of what is there; false: nothing is. After the end of the output, there is no
  /// descriptor.
  bool pump(const std::string& name) {
    std::array<char, 4096> buffer;
    const ssize_t now = read(fd_, buffer.data(), buffer.size());
    if (now < 0 && errno == EINTR) return true;
    if (now < 0 && errno == EAGAIN) return false;
    if (now > 0) text_.append(buffer.data(), static_cast<std::size_t>(now));
    show_lines(name);
    if (now <= 0) end(name);
    return now > 0;
  }
  /// The process has ended. What it has said is there; others that it has started may hold the
  /// pipe, and write, for ever.
  void drain(const std::string& name) {
    for (std::size_t left = most_in(fd_) / PIPE_BUF + 1; left > 0 && pump(name); --left) {
    }
    if (fd_ >= 0) end(name);
  }
  const std::deque<std::string>& last() const noexcept { return last_; }

 private:
  void show_lines(const std::string& name) {
    std::size_t begin = 0;
    for (std::size_t end; (end = text_.find('\n', begin)) != std::string::npos; begin = end + 1) {
      show(name, text_.substr(begin, end - begin));
    }
    text_.erase(0, begin);
    if (text_.size() >= kMostLine) show(name, std::exchange(text_, {}));
  }
  void end(const std::string& name) {
    if (!text_.empty()) show(name, std::exchange(text_, {}));
    set(-1);
  }
  void show(const std::string& name, std::string line) {
    last_.push_back(std::move(line));
    rt::to_stderr("[{}] {}\n", name, last_.back());
    if (last_.size() > kLastLines) last_.pop_front();
  }

  static constexpr std::size_t kLastLines = 3;
  // Limit: bytes of a line of a process. At it: the line is broken. Seen: the output.
  static constexpr std::size_t kMostLine = 64 << 10;
  int fd_ = -1;
  std::string text_;
  std::deque<std::string> last_;
};

struct Supervisor::Child {
  explicit Child(const SystemDescription& process) : name(process.name) {
    if (process.components.empty()) return;
    const auto found = process.restarts.find(process.components.front().container);
    if (found != process.restarts.end()) restart = found->second;
  }
  const std::string name;
  // Whether it runs and has completed its start or restart.
  bool takes_part() const { return pid > 0 && !has_ended && steps.empty(); }
  void leaves() {
    has_ended = true;
    end_limit = later(Clock::steady().now(), kEndLimit);
  }

  RestartOptions restart;
  pid_t pid = 0;  // 0: not running
  int pidfd = -1;
  bool is_made = false;           // its constructors have returned, because it has sent a document
  std::deque<std::string> steps;  // of a restart: commands without a response so far
  std::optional<Channel> channel;
  Output output;
  bool has_ended = false;        // it sends nothing more
  TimePoint end_limit = kNever;  // when one that has ended so is killed
  std::string error;             // the last error that it reported
  std::string death;
  int restarts = 0;
  TimePoint restart_at = kNever;
};

Supervisor::Supervisor(const std::vector<SystemDescription>& processes,
                       std::vector<std::string> words, const EndSignals& signals)
    : words_(std::move(words)), signals_(signals) {
  for (const SystemDescription& process : processes) {
    children_.push_back(std::make_unique<Child>(process));
  }
  for (const auto& child : children_) begin(*child);
}

Supervisor::~Supervisor() {
  is_ending_ = true;
  for (const auto& child : children_) {
    if (child->channel) child->channel->finish();  // a child that still runs sees this end
  }
  if (limit_ == kNever) bound_end(false);  // the start has failed
  say_who_is_unmade();
  while (end_some()) {
    const TimePoint now = Clock::steady().now();
    if (now >= limit_) {
      end_now("it does not end in time");
      limit_ = kNever;
    } else if (const int signal = signals_.take(); signal != 0) {
      if (is_hurried_) end_now("another " + name_of_signal(signal) + " arrived");
      hurry();
    }
    pump(std::min(later(now, 1h), limit_) - now);
  }
}

std::vector<json> Supervisor::hear() {
  std::vector<json> answers;
  for (const auto& child : children_) {
    if (!child->takes_part()) continue;
    answers.push_back(hear(*child));
  }
  return answers;
}

std::vector<json> Supervisor::ask(const std::string& word) {
  for (const auto& child : children_) {
    if (child->takes_part()) child->channel->send({{"do", word}, {"signal", signal_}});
  }
  return hear();
}

void Supervisor::ask_to_match(const std::vector<std::vector<std::uint64_t>>& wanted) {
  for (std::size_t i = 0; i < children_.size(); ++i) {
    children_[i]->channel->send({{"do", "match"}, {"wanted", wanted[i]}});
  }
  hear();
}

// A process may run before it has answered, and another may answer late.
void Supervisor::release() {
  for (const auto& child : children_) {
    child->channel->send({{"do", "release"}, {"is_first", true}});
  }
  for (const auto& child : children_) {
    while (!answer_of(*child) && !child->has_ended) wait_for(*child);
  }
}

void Supervisor::bound_end(bool uses_shared_memory) {
  const bool may_hang = uses_shared_memory && !are_complete();
  limit_ = later(Clock::steady().now(), may_hang ? kEndLimitAfterDeaths : kEndLimit);
}

void Supervisor::watch(Nanoseconds duration) {
  has_run_ = true;
  Progress progress(duration);
  for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
    TimePoint next = kNever;
    bool is_any_left = false;
    for (const auto& child : children_) {
      if (child->restart_at <= now) restart(*child);
      next = std::min({next, child->restart_at, child->end_limit});
      is_any_left |= child->pid > 0 || child->restart_at != kNever;
    }
    signal_ = signals_.take();
    if (!is_any_left || signal_ != 0) break;
    pump(std::min(progress.show(now), next - now));
    for (const auto& child : children_) {
      if (child->pid > 0) go_on(*child);
      if (is_gone(*child)) handle_end(*child);
    }
  }
  for (const auto& child : children_) {
    if (child->pid > 0 && child->has_ended) {  // as the run ends
      await_end(*child);
      handle_end(*child);
    }
    child->restart_at = kNever;
    if (child->pid <= 0 || child->takes_part()) continue;
    child->death =
        fmt::format("process '{}' had not completed its restart at the end", child->name);
    deaths_.push_back(child->death);
    child->channel->finish();
  }
}

std::vector<std::string> Supervisor::failures() const {
  std::vector<std::string> result;
  for (const auto& child : children_) {
    if (!child->takes_part()) result.push_back(child->death);
  }
  return result;
}

// ---- Private ----

void Supervisor::begin(Child& child) {
  std::array<int, 2> ends{}, output{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0 ||
      pipe2(output.data(), O_CLOEXEC) != 0) {
    throw Error("cannot create a socket pair: " + errno_message(errno));
  }
  // A program of its own, not a fork of this one: it shares no written page with its parent, so its
  // memory is what it would be without one.
  std::vector<std::string> words = words_;
  for (const std::string& word : {std::string("--process"), child.name, std::string("--connection"),
                                  std::to_string(ends[1])}) {
    words.push_back(word);
  }
  const pid_t pid = fork();
  if (pid < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (pid == 0) {
    dup2(output[1], STDOUT_FILENO), dup2(output[1], STDERR_FILENO);
    fcntl(ends[1], F_SETFD, 0);
    become_takt(std::move(words));
  }
  close(ends[1]), close(output[1]);
  fcntl(output[0], F_SETFL, O_NONBLOCK);
  child.pid = pid;
  child.pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  child.is_made = false;
  child.channel.emplace(ends[0]);
  child.output.set(output[0]);
  child.has_ended = false;
  child.end_limit = kNever;
  child.error.clear();
}

// The other processes run already, so do not wait for all to match.
void Supervisor::restart(Child& child) {
  child.restart_at = kNever;
  ++child.restarts;
  begin(child);
  child.steps = {"make", "start", "release"};  // it starts "make" without a command
}

void Supervisor::go_on(Child& child) {
  while (!child.steps.empty() && answer_of(child)) {
    child.steps.pop_front();
    if (!child.steps.empty()) child.channel->send({{"do", child.steps.front()}});
  }
}

std::optional<json> Supervisor::answer_of(Child& child) {
  while (std::optional<json> answer = child.channel->next()) {
    if (!answer->contains("error")) {
      child.is_made = true;
      return answer;
    }
    child.error = answer->at("error");
  }
  return std::nullopt;
}

json Supervisor::hear(Child& child) {
  for (;;) {
    if (std::optional<json> answer = answer_of(child)) return std::move(*answer);
    if (child.has_ended) {
      await_end(child);
      if (has_run_) throw std::runtime_error(end_of(child));
      throw Error(end_of(child));  // the file may be wrong
    }
    wait_for(child);
  }
}

void Supervisor::wait_for(const Child& child) {
  if (const int signal = signals_.take(); signal != 0) {
    hurry();
    throw Interrupted(signal, fmt::format(" while waiting for process '{}'", child.name));
  }
  if (Clock::steady().now() > limit_) {
    kill(child.pid, SIGKILL);
    hurry();  // the others can end now
  }
  pump(std::min<Nanoseconds>(1s, between(Clock::steady().now(), limit_)));
}

// What is sound has this time for its destructors; what hangs is killed then. Once: a second one
// that hangs would give the others as long again.
void Supervisor::hurry() {
  if (std::exchange(is_hurried_, true)) return;
  // EndSignals ends this process at kHurriedEndLimit, and one that is stopped would be left.
  limit_ = later(Clock::steady().now(), kHurriedEndLimit - 500ms);
}

// Waits for output and responses of the children, at most this long, and reads them.
void Supervisor::pump(Nanoseconds most) {
  std::vector<pollfd> events{{signals_.fd(), POLLIN, 0}};
  for (const auto& child : children_) {
    const bool listens = child->channel && !child->has_ended;
    events.push_back({listens ? child->channel->fd() : -1, POLLIN, 0});
    events.push_back({child->output.fd(), POLLIN, 0});
    events.push_back({child->pidfd, POLLIN, 0});
  }
  const timespec time = to_timespec(most);
  if (ppoll(events.data(), events.size(), &time, nullptr) <= 0) return;
  for (std::size_t i = 0; i < children_.size(); ++i) {
    Child& child = *children_[i];
    if (events[3 * i + 2].revents != 0) child.output.pump(child.name);
    const bool listens = child.channel && !child.has_ended;
    if (listens && events[3 * i + 1].revents != 0 && !child.channel->read_some()) child.leaves();
    // A process that it has started may hold the connection.
    if (listens && events[3 * i + 3].revents != 0 && !child.channel->has_more()) child.leaves();
  }
}

/// Whether the process has ended. One that has only closed its connection is killed when its time
/// is over.
bool Supervisor::is_gone(const Child& child) {
  if (child.pid <= 0 || !child.has_ended) return false;
  siginfo_t info{};
  waitid(P_PID, static_cast<id_t>(child.pid), &info, WEXITED | WNOHANG | WNOWAIT);
  if (info.si_pid == child.pid) return true;
  if (Clock::steady().now() >= child.end_limit) kill(child.pid, SIGKILL);
  return false;
}

void Supervisor::await_end(Child& child) {
  child.end_limit = std::min(child.end_limit, later(Clock::steady().now(), kHurriedEndLimit));
  while (!is_gone(child)) {
    const timespec time =
        to_timespec(std::max<Nanoseconds>(between(Clock::steady().now(), child.end_limit), 10ms));
    pollfd event{child.pidfd, POLLIN, 0};
    ppoll(&event, 1, &time, nullptr);
  }
}

// Removes the children that have ended. Returns false if none is left.
bool Supervisor::end_some() {
  bool is_any_left = false;
  for (const auto& child : children_) {
    if (child->pid <= 0) continue;
    if (child->channel) answer_of(*child);
    if (waitpid(child->pid, nullptr, WNOHANG) == 0) {
      is_any_left = true;
      continue;
    }
    forget(*child);
    child->output.drain(child->name);
  }
  return is_any_left;
}

void Supervisor::say_who_is_unmade() const {
  std::vector<std::string> names;
  for (const auto& child : children_) {
    if (child->pid > 0 && !child->is_made) names.push_back("'" + child->name + "'");
  }
  if (names.empty()) return;
  rt::to_stderr("takt: waiting for constructors of process {}, {} s at most\n",
                fmt::join(names, ", "), (is_hurried_ ? kHurriedEndLimit : kEndLimit).count());
}

void Supervisor::end_now(const std::string& why) {
  for (const auto& child : children_) {
    if (child->pid <= 0) continue;
    rt::to_stderr("takt: killing process '{}': {}\n", child->name, why);
    kill(child->pid, SIGKILL);
  }
}

void Supervisor::forget(Child& child) {
  child.pid = 0;
  child.end_limit = kNever;
  close(std::exchange(child.pidfd, -1));
  child.channel.reset();
  child.steps.clear();
}

// Of a process that is_gone(): "process 'x' was ended by signal 9 (Killed)", with its last output.
std::string Supervisor::end_of(Child& child) {
  while (auto word = child.channel->next()) {
    if (word->contains("error")) child.error = word->at("error");
  }
  siginfo_t info{};
  waitid(P_PID, static_cast<id_t>(child.pid), &info, WEXITED | WNOWAIT);
  child.output.drain(child.name);
  if (!child.error.empty()) return fmt::format("process '{}': {}", child.name, child.error);
  std::string text =
      info.si_code == CLD_EXITED
          ? fmt::format("process '{}' has ended with status {}", child.name, info.si_status)
          : fmt::format("process '{}' was ended by signal {} ({})", child.name, info.si_status,
                        sigdescr_np(info.si_status));
  if (!child.output.last().empty()) {
    text += fmt::format("; its last output: {}", fmt::join(child.output.last(), " | "));
  }
  return text;
}

void Supervisor::handle_end(Child& child) {
  child.death = end_of(child);
  int status = 0;
  waitpid(child.pid, &status, 0);
  forget(child);
  const bool has_failed = !WIFEXITED(status) || WEXITSTATUS(status) != 0;
  const bool is_wanted = child.restart.policy == RestartOptions::Policy::always ||
                         (child.restart.policy == RestartOptions::Policy::on_failure && has_failed);
  std::string then = "the others continue";
  if (is_wanted && child.restarts < child.restart.most) {
    child.restart_at = later(Clock::steady().now(), child.restart.delay);
    then = fmt::format("restart {} of {} in {}", child.restarts + 1, child.restart.most,
                       to_string(child.restart.delay));
  } else if (is_wanted) {
    then = fmt::format("it was restarted {} times already; the others continue", child.restarts);
  }
  deaths_.push_back(fmt::format("{}; {}", child.death, then));
  rt::to_stderr("takt: {}\n", deaths_.back());
}

}  // namespace takt::tools
