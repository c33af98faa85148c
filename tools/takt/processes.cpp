// SPDX-License-Identifier: Apache-2.0
#include "processes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "result_json.hpp"
#include "shared_memory.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kMatchLimit = 10s;
constexpr auto kDrainLimit = 5s;
constexpr auto kSharedMemoryEndLimit = 30s;

// ---- Waiting ----

/// The signals that end a run, as a file descriptor. SIGUSR1: one of our executors has failed.
class EndSignals {
 public:
  EndSignals() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&signals, signal);
    // Blocked before any thread or process exists, so that this descriptor alone takes them.
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    fd_ = signalfd(-1, &signals, SFD_CLOEXEC);
    if (fd_ < 0) throw Error("signals cannot be received: " + errno_message(errno));
  }
  ~EndSignals() { close(fd_); }
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  int fd() const noexcept { return fd_; }
  /// Whether one has come; it is taken.
  bool take() const {
    signalfd_siginfo ignored{};
    pollfd news{fd_, POLLIN, 0};
    return poll(&news, 1, 0) == 1 && read(fd_, &ignored, sizeof ignored) > 0;
  }
  /// From here on another one has its usual effect: who stops and does not come to an end is ended.
  void let_through() const {
    while (take()) {
    }
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  }

 private:
  int fd_;
};

/// Shows how much of a run is over, on a terminal.
class Progress {
 public:
  explicit Progress(Nanoseconds duration)
      : duration_(duration), is_shown_(isatty(STDERR_FILENO) != 0 && duration > 2s) {}
  ~Progress() {
    if (is_shown_) fmt::print(stderr, "\r                    \r");
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  TimePoint end() const { return duration_ == Nanoseconds::zero() ? kNever : start_ + duration_; }
  /// Shows it now; returns how long one may sleep.
  timespec show(TimePoint now) const {
    Nanoseconds step = end() == kNever ? std::chrono::hours(24) : end() - now;
    if (is_shown_) {
      fmt::print(stderr, "\r{:.0f} of {:.0f} s ",
                 std::chrono::duration<double>(now - start_).count(),
                 std::chrono::duration<double>(duration_).count());
      step = std::min<Nanoseconds>(step, 1s);
    }
    return {step / 1s, (step % 1s).count()};
  }

 private:
  const Nanoseconds duration_;
  const TimePoint start_ = Clock::steady().now();
  const bool is_shown_;
};

// ---- Endpoints ----

json endpoints_json(const Container& container) {
  json result = json::array();
  for (const EndpointState& endpoint : container.endpoints()) {
    result.push_back({{"topic", endpoint.topic},
                      {"type", endpoint.type},
                      {"is_writer", endpoint.is_writer},
                      {"is_reliable", endpoint.reliability == Reliability::reliable},
                      {"matched", endpoint.matched},
                      {"messages", endpoint.messages},
                      {"way", endpoint.way},
                      {"uncopied", endpoint.uncopied},
                      {"lost", endpoint.lost},
                      {"id", endpoint.id}});
  }
  return result;
}

/// The endpoints of a process that are for the result: those of its own topics, not of services.
void add_topics(json& topics, const std::string& process, const json& endpoints) {
  for (json endpoint : endpoints) {
    if (!endpoint.at("topic").get_ref<const std::string&>().starts_with('/')) continue;
    endpoint["process"] = process;
    endpoint.erase("id");
    topics.push_back(std::move(endpoint));
  }
}

// ---- One process ----

json run_here(SystemDescription system, const ContainerOverrides& overrides, Nanoseconds duration,
              const EndSignals& signals, bool loads) {
  std::vector<ComponentDescription> later;
  if (loads) later.swap(system.components);
  Container container(system, overrides);
  container.start([] { kill(getpid(), SIGUSR1); });
  // What load_node does; that the request came from outside leaves no trace in what is measured.
  for (ComponentDescription& component : later) container.load(std::move(component));
  container.release();
  {
    const Progress progress(duration);
    pollfd news{signals.fd(), POLLIN, 0};
    for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
      const timespec time = progress.show(now);
      if (ppoll(&news, 1, &time, nullptr) > 0) break;
    }
  }
  signals.let_through();
  container.hold();
  container.shut_down();
  container.stop();
  json result = process_json(container.result());
  add_topics(result["topics"] = json::array(), system.name, endpoints_json(container));
  return result;
}

// ---- Several: what parent and child say to each other ----

/// One JSON document a line, over a socket pair.
class Channel {
 public:
  explicit Channel(int fd) : fd_(fd) {}
  ~Channel() { close(fd_); }
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  int fd() const noexcept { return fd_; }

  /// False: the other one has gone.
  bool send(const json& document) {
    const std::string line = document.dump() + "\n";
    for (std::size_t sent = 0; sent < line.size();) {
      const ssize_t now = ::send(fd_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
      if (now < 0 && errno == EINTR) continue;
      if (now <= 0) return false;
      sent += static_cast<std::size_t>(now);
    }
    return true;
  }
  /// The next document that has come.
  std::optional<json> next() {
    const std::size_t end = received_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    json document = json::parse(received_.substr(0, end));
    received_.erase(0, end + 1);
    return document;
  }
  /// Waits for a part of one. False: the other one has gone.
  bool read_some() {
    std::array<char, 65536> buffer;
    for (;;) {
      const ssize_t now = read(fd_, buffer.data(), buffer.size());
      if (now < 0 && errno == EINTR) continue;
      if (now > 0) received_.append(buffer.data(), static_cast<std::size_t>(now));
      return now > 0;
    }
  }
  std::optional<json> receive() {
    for (;;) {
      if (auto document = next()) return document;
      if (!read_some()) return std::nullopt;
    }
  }

 private:
  const int fd_;
  std::string received_;
};

/// Waits until each end of a topic has found as many others as the parent has counted.
void wait_for_matches(const Container& container, const json& wanted) {
  const TimePoint limit = Clock::steady().now() + kMatchLimit;
  for (;;) {
    const std::vector<EndpointState> endpoints = container.endpoints();
    const EndpointState* lonely = nullptr;
    for (std::size_t i = 0; i < wanted.size() && lonely == nullptr; ++i) {
      if (endpoints.at(i).matched < wanted[i].get<std::size_t>()) lonely = &endpoints[i];
    }
    if (lonely == nullptr) return;
    if (Clock::steady().now() > limit) {
      throw Error(fmt::format("topic '{}': a {} has found {} of its partners in other processes "
                              "after {} s",
                              lonely->topic, lonely->is_writer ? "publisher" : "subscription",
                              lonely->matched, kMatchLimit.count()),
                  "is another program on the same DDS domain, or a firewall on lo?");
    }
    std::this_thread::sleep_for(2ms);
  }
}

/// The child's whole life. It does what the parent says, and ends when the parent is gone, or when
/// one of its executors has failed.
int serve(const SystemDescription& system, const ContainerOverrides& overrides, int socket) {
  Channel parent(socket);
  try {
    const int failed = eventfd(0, EFD_CLOEXEC);
    Container container(system, overrides);
    const bool serves_itself = system.dds && system.dds->serves_own_process;
    const auto ends = [&]() -> json {
      return {{"endpoints", endpoints_json(container)}, {"serves_itself", serves_itself}};
    };
    parent.send(ends());
    for (;;) {
      std::array<pollfd, 2> news{{{parent.fd(), POLLIN, 0}, {failed, POLLIN, 0}}};
      poll(news.data(), news.size(), -1);
      if (news[1].revents != 0) {
        container.hold();
        container.stop();  // throws what the callback threw
      }
      if (news[0].revents == 0) continue;
      const std::optional<json> command = parent.receive();
      if (!command) return 0;
      const std::string& word = command->at("do").get_ref<const std::string&>();
      json answer = json::object();
      if (word == "match") {
        wait_for_matches(container, command->at("wanted"));
      } else if (word == "start") {
        container.start([failed] { eventfd_write(failed, 1); });
      } else if (word == "release") {
        container.release();
      } else if (word == "hold") {
        container.hold();
      } else if (word == "status") {
        answer = ends();
        answer["pending"] = container.pending();
      } else if (word == "shut_down") {
        container.shut_down();
      } else if (word == "stop") {
        container.stop();
        answer = {{"result", process_json(container.result())}};
      }
      parent.send(answer);
    }
  } catch (const std::exception& error) {
    Logger::instance().flush();
    parent.send({{"error", error.what()}});
    return 1;
  }
}

// ---- Several: the parent ----

/// The processes of a run. What they write comes out with their names.
class Children {
 public:
  Children(const std::vector<SystemDescription>& processes, const ContainerOverrides& overrides,
           const EndSignals& signals)
      : overrides_(overrides), signals_(signals) {
    for (const SystemDescription& process : processes) {
      children_.push_back(std::make_unique<Child>(process));
    }
    for (const auto& child : children_) begin(*child);
  }
  ~Children() {
    for (const auto& child : children_) child->channel.reset();  // who still runs sees this end
    for (const auto& child : children_) {
      if (child->pid > 0) {
        end_in_time(*child);
        waitpid(child->pid, nullptr, 0);
      }
      while (child->output.fd() >= 0) child->output.pump(child->name);
    }
  }
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// What each says to begin with, or answers to the command. All are asked before any is heard.
  /// Throws Error when one has ended.
  std::vector<json> hear() {
    std::vector<json> answers;
    for (const auto& child : children_) {
      if (child->pid <= 0) continue;
      answers.push_back(hear(*child));
    }
    return answers;
  }
  std::vector<json> ask(const std::string& word) {
    for (const auto& child : children_) {
      if (child->channel) child->channel->send({{"do", word}});
    }
    return hear();
  }
  void ask_to_match(const std::vector<json>& wanted) {
    for (std::size_t i = 0; i < children_.size(); ++i) {
      children_[i]->channel->send({{"do", "match"}, {"wanted", wanted[i]}});
    }
    hear();
  }

  /// From here on who does not end, or answer, in time is killed: one that publishes may wait for a
  /// lock in shared memory that a killed process has kept.
  void bound_end() { limit_ = Clock::steady().now() + kSharedMemoryEndLimit; }

  /// Until the time is up, a signal comes, or none is left. One that ends meanwhile is started
  /// again, as its description says; the others go on.
  void watch(Nanoseconds duration) {
    const Progress progress(duration);
    for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
      TimePoint next = kNever;
      bool is_any_left = false;
      for (const auto& child : children_) {
        if (child->begin_again <= now) begin_again(*child);
        next = std::min(next, child->begin_again);
        is_any_left |= child->pid > 0 || child->begin_again != kNever;
      }
      if (!is_any_left || signals_.take()) break;
      timespec time = progress.show(now);
      if (next != kNever && next - now < std::chrono::seconds(time.tv_sec)) {
        time = {(next - now) / 1s, ((next - now) % 1s).count()};
      }
      pump(time);
      for (const auto& child : children_) {
        if (child->pid > 0 && child->has_ended) bury(*child);
      }
    }
    for (const auto& child : children_) child->begin_again = kNever;
  }

  /// Who has ended, and how; and of these, who was not started again.
  const std::vector<std::string>& deaths() const noexcept { return deaths_; }
  std::vector<std::string> failures() const {
    std::vector<std::string> result;
    for (const auto& child : children_) {
      if (child->pid <= 0) result.push_back(child->death);
    }
    return result;
  }
  bool are_complete() const noexcept { return deaths_.empty(); }

 private:
  /// What a process writes, line by line.
  class Output {
   public:
    ~Output() { set(-1); }
    void set(int fd) {
      if (fd_ >= 0) close(fd_);
      fd_ = fd;
    }
    int fd() const noexcept { return fd_; }
    /// Waits for a part; at the end there is no descriptor any more.
    void pump(const std::string& name) {
      std::array<char, 4096> buffer;
      const ssize_t now = read(fd_, buffer.data(), buffer.size());
      if (now < 0 && errno == EINTR) return;
      if (now > 0) text_.append(buffer.data(), static_cast<std::size_t>(now));
      if (now <= 0 && !text_.empty()) text_ += '\n';
      for (std::size_t end; (end = text_.find('\n')) != std::string::npos;) {
        last_.push_back(text_.substr(0, end));
        text_.erase(0, end + 1);
        fmt::print(stderr, "[{}] {}\n", name, last_.back());
        if (last_.size() > kLastLines) last_.pop_front();
      }
      if (now <= 0) set(-1);
    }
    const std::deque<std::string>& last() const noexcept { return last_; }

   private:
    static constexpr std::size_t kLastLines = 3;
    int fd_ = -1;
    std::string text_;
    std::deque<std::string> last_;
  };

  struct Child {
    explicit Child(const SystemDescription& process) : description(process), name(process.name) {
      if (process.components.empty()) return;
      const auto found = process.restarts.find(process.components.front().container);
      if (found != process.restarts.end()) restart = found->second;
    }
    const SystemDescription& description;
    const std::string name;
    RestartOptions restart;
    pid_t pid = 0;  // 0: it does not run
    std::optional<Channel> channel;
    Output output;
    bool has_ended = false;  // it says nothing more
    std::string error;       // its own last word
    std::string death;
    int restarts = 0;
    TimePoint begin_again = kNever;
  };

  void begin(Child& child) {
    std::array<int, 2> ends{}, output{};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0 ||
        pipe2(output.data(), O_CLOEXEC) != 0) {
      throw Error("no connection to a process: " + errno_message(errno));
    }
    const pid_t pid = fork();
    if (pid < 0) throw Error("no process: " + errno_message(errno));
    if (pid == 0) {
      const SystemDescription description = child.description;
      children_.clear();  // closes our copies of the others' connections
      close(ends[0]), close(output[0]);
      dup2(output[1], STDOUT_FILENO), dup2(output[1], STDERR_FILENO);
      close(output[1]);
      const int status = serve(description, overrides_, ends[1]);
      Logger::instance().flush();
      std::fflush(nullptr);
      // Without a return through the parent's frames; not _exit, as iceoryx says goodbye to RouDi
      // when static objects go.
      std::exit(status);
    }
    close(ends[1]), close(output[1]);
    child.pid = pid;
    child.channel.emplace(ends[0]);
    child.output.set(output[0]);
    child.has_ended = false;
    child.error.clear();
  }

  // The others run already, so there is no time at which all are matched.
  void begin_again(Child& child) {
    child.begin_again = kNever;
    ++child.restarts;
    begin(child);
    try {
      hear(child);
      for (const char* word : {"start", "release"}) {
        child.channel->send({{"do", word}});
        hear(child);
      }
    } catch (const Error&) {
      if (child.pid <= 0) throw;  // interrupted
      bury(child);
    }
  }

  json hear(Child& child) {
    for (;;) {
      if (std::optional<json> answer = child.channel->next()) {
        if (!answer->contains("error")) return std::move(*answer);
        child.error = answer->at("error");
        continue;
      }
      if (child.has_ended) throw Error(end_of(child));
      if (signals_.take()) {
        for (const auto& other : children_) {
          if (other->pid > 0) kill(other->pid, SIGKILL);
        }
        throw Error(fmt::format("interrupted while process '{}' was awaited", child.name));
      }
      if (Clock::steady().now() > limit_) kill(child.pid, SIGKILL);
      pump({1, 0});
    }
  }

  void end_in_time(const Child& child) const {
    if (limit_ == kNever) return;
    const Nanoseconds left = limit_ - Clock::steady().now();
    pollfd end{static_cast<int>(syscall(SYS_pidfd_open, child.pid, 0)), POLLIN, 0};
    if (poll(&end, 1, static_cast<int>(std::max(left / 1ms, 0L))) == 0) {
      fmt::print(stderr, "takt: process '{}' does not end; it is killed\n", child.name);
      kill(child.pid, SIGKILL);
    }
    close(end.fd);
  }

  // Takes what has been written and said, for which it sleeps.
  void pump(const timespec& time) {
    std::vector<pollfd> news{{signals_.fd(), POLLIN, 0}};
    for (const auto& child : children_) {
      const bool listens = child->channel && !child->has_ended;
      news.push_back({listens ? child->channel->fd() : -1, POLLIN, 0});
      news.push_back({child->output.fd(), POLLIN, 0});
    }
    if (ppoll(news.data(), news.size(), &time, nullptr) <= 0) return;
    for (std::size_t i = 0; i < children_.size(); ++i) {
      Child& child = *children_[i];
      if (news[2 * i + 2].revents != 0) child.output.pump(child.name);
      if (news[2 * i + 1].revents != 0) child.has_ended = !child.channel->read_some();
    }
  }

  /// "process 'x' was ended by signal 9 (Killed)", with its last words.
  std::string end_of(Child& child) {
    while (auto word = child.channel->next()) {
      if (word->contains("error")) child.error = word->at("error");
    }
    siginfo_t info{};
    waitid(P_PID, static_cast<id_t>(child.pid), &info, WEXITED | WNOWAIT);
    while (child.output.fd() >= 0) child.output.pump(child.name);
    if (!child.error.empty()) return fmt::format("process '{}': {}", child.name, child.error);
    std::string text =
        info.si_code == CLD_EXITED
            ? fmt::format("process '{}' has ended with status {}", child.name, info.si_status)
            : fmt::format("process '{}' was ended by signal {} ({})", child.name, info.si_status,
                          sigdescr_np(info.si_status));
    if (!child.output.last().empty()) {
      text += fmt::format("; its last words: {}", fmt::join(child.output.last(), " | "));
    }
    return text;
  }

  void bury(Child& child) {
    child.death = end_of(child);
    int status = 0;
    waitpid(child.pid, &status, 0);
    child.pid = 0;
    child.channel.reset();
    const bool has_failed = !WIFEXITED(status) || WEXITSTATUS(status) != 0;
    const bool is_wanted =
        child.restart.policy == RestartOptions::Policy::always ||
        (child.restart.policy == RestartOptions::Policy::on_failure && has_failed);
    std::string then = "the others go on";
    if (is_wanted && child.restarts < child.restart.most) {
      child.begin_again = Clock::steady().now() + child.restart.delay;
      then = fmt::format("restart {} of {} in {}", child.restarts + 1, child.restart.most,
                         to_string(child.restart.delay));
    } else if (is_wanted) {
      then = fmt::format("it was restarted {} times already; the others go on", child.restarts);
    }
    deaths_.push_back(fmt::format("{}; {}", child.death, then));
    fmt::print(stderr, "takt: {}\n", deaths_.back());
  }

  const ContainerOverrides overrides_;
  const EndSignals& signals_;
  TimePoint limit_ = kNever;
  std::vector<std::unique_ptr<Child>> children_;
  std::vector<std::string> deaths_;
};

/// Calls `pair(writer, reader, its process)` for each end that writes and each that reads the same
/// topic by DDS.
template <class Pair>
void for_each_pair(const std::vector<json>& processes, Pair&& pair) {
  for (std::size_t from = 0; from < processes.size(); ++from) {
    for (const json& writer : processes[from].at("endpoints")) {
      if (!writer.at("is_writer")) continue;
      for (std::size_t to = 0; to < processes.size(); ++to) {
        // What a process sends to itself is counted where it goes by DDS too.
        if (to == from && !processes[from].at("serves_itself")) continue;
        const json& readers = processes[to].at("endpoints");
        for (std::size_t i = 0; i < readers.size(); ++i) {
          const json& reader = readers[i];
          if (!reader.at("is_writer") && reader.at("topic") == writer.at("topic") &&
              reader.at("type") == writer.at("type") &&
              (writer.at("is_reliable") || !reader.at("is_reliable"))) {
            pair(from, writer, to, i);
          }
        }
      }
    }
  }
}

/// How many others each end has, by process and in the order of its endpoints.
std::vector<json> count_matches(const std::vector<json>& processes) {
  std::vector<json> wanted;
  for (const json& process : processes) {
    wanted.push_back(std::vector<int>(process.at("endpoints").size(), 0));
  }
  const auto add_one = [](json& count) { count = count.get<int>() + 1; };
  for_each_pair(processes,
                [&](std::size_t from, const json& writer, std::size_t to, std::size_t i) {
                  add_one(wanted[to][i]);
                  const json& endpoints = processes[from].at("endpoints");
                  for (std::size_t j = 0; j < endpoints.size(); ++j) {
                    if (&endpoints[j] == &writer) add_one(wanted[from][j]);
                  }
                });
  return wanted;
}

/// How many messages were sent to each reader from other processes, in the same order.
std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<json>& processes) {
  std::vector<std::vector<std::uint64_t>> sent;
  for (const json& process : processes) sent.emplace_back(process.at("endpoints").size(), 0);
  for_each_pair(processes, [&](std::size_t, const json& writer, std::size_t to, std::size_t i) {
    sent[to][i] += writer.at("messages").get<std::uint64_t>();
  });
  return sent;
}

/// The ends of each topic: process and number.
using Ends = std::map<std::string, std::set<std::pair<std::size_t, std::uint64_t>>>;
Ends ends_of(const std::vector<json>& processes) {
  Ends ends;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    for (const json& endpoint : processes[process].at("endpoints")) {
      ends[endpoint.at("topic")].emplace(process, endpoint.at("id").get<std::uint64_t>());
    }
  }
  return ends;
}

/// Of which topics all who have sent can still be asked, and all who read were there: those that
/// have the same ends as in the beginning, while no process has died.
class Countable {
 public:
  Countable(const Children& children, Ends beginning)
      : children_(children), beginning_(std::move(beginning)) {}
  bool operator()(const Ends& now, const std::string& topic) const {
    const auto then = beginning_.find(topic);
    return children_.are_complete() && then != beginning_.end() && then->second == now.at(topic);
  }

 private:
  const Children& children_;
  const Ends beginning_;
};

/// Nothing is pending anywhere and, where that can be counted, every message that was sent has
/// arrived. More have where a process outside the run sends too, as `takt component` does.
bool all_is_served(const std::vector<json>& processes, const Countable& is_countable) {
  const auto sent = count_sent(processes);
  const Ends ends = ends_of(processes);
  for (std::size_t process = 0; process < processes.size(); ++process) {
    if (processes[process].at("pending") != 0) return false;
    const json& endpoints = processes[process].at("endpoints");
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (!endpoints[i].at("is_writer") && endpoints[i].at("is_reliable") &&
          endpoints[i].at("messages").get<std::uint64_t>() < sent[process][i] &&
          is_countable(ends, endpoints[i].at("topic"))) {
        return false;
      }
    }
  }
  return true;
}

/// The state of all when all is served; else when the time is up.
std::vector<json> drain(Children& children, const Countable& is_countable) {
  const TimePoint limit = Clock::steady().now() + kDrainLimit;
  std::vector<json> before;
  for (;;) {
    std::vector<json> now = children.ask("status");
    // Twice the same: a message can be on its way from one that was asked late to one that was
    // asked early.
    if ((all_is_served(now, is_countable) && now == before) || Clock::steady().now() > limit) {
      return now;
    }
    before = std::move(now);
    std::this_thread::sleep_for(5ms);
  }
}

/// What a process could not know: how much was sent to it by others.
template <class IsCountable>
void complete(json& callbacks, const json& endpoints, const std::vector<std::uint64_t>& sent,
              IsCountable&& is_countable) {
  std::vector<bool> used(endpoints.size(), false);
  for (json& callback : callbacks) {
    if (callback.at("kind") != "subscription") continue;
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (used[i] || endpoints[i].at("is_writer") ||
          endpoints[i].at("topic") != callback.at("topic")) {
        continue;
      }
      used[i] = true;
      if (!is_countable(endpoints[i].at("topic"))) break;
      const auto number = [&](const char* key) { return callback.at(key).get<std::uint64_t>(); };
      const std::uint64_t expected = number("expected") - number("from_outside") + sent[i];
      const std::uint64_t served = number("received") + number("dropped");
      callback["expected"] = expected;
      callback["lost"] = expected > served ? expected - served : 0;
      break;
    }
  }
}

bool uses_shared_memory(const std::vector<json>& processes) {
  return std::any_of(processes.begin(), processes.end(), [](const json& process) {
    const json& endpoints = process.at("endpoints");
    return std::any_of(endpoints.begin(), endpoints.end(),
                       [](const json& endpoint) { return endpoint.at("way") == "shared memory"; });
  });
}

json run_apart(const std::vector<SystemDescription>& processes, const ContainerOverrides& overrides,
               Nanoseconds duration, const EndSignals& signals) {
  Children children(processes, overrides, signals);
  const std::vector<json> beginning = children.hear();
  children.ask_to_match(count_matches(beginning));
  children.ask("start");
  children.ask("release");
  children.watch(duration);
  if (uses_shared_memory(beginning)) children.bound_end();
  children.ask("hold");
  const Countable is_countable(children, ends_of(beginning));
  const std::vector<json> states = drain(children, is_countable);
  const Ends ends = ends_of(states);
  const auto sent = count_sent(states);
  children.ask("shut_down");
  const std::vector<json> answers = children.ask("stop");

  json all = process_json({});
  for (const char* list :
       {"callbacks", "chains", "threads", "processes", "trace", "notes", "topics"}) {
    all[list] = json::array();
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    json one = answers[i].at("result");
    complete(one.at("callbacks"), states[i].at("endpoints"), sent[i],
             [&](const std::string& topic) { return is_countable(ends, topic); });
    all["duration_s"] = one.at("duration_s");
    add_topics(all.at("topics"), one.at("processes").at(0).at("name"), states[i].at("endpoints"));
    for (const char* list : {"callbacks", "chains", "threads", "processes", "trace", "notes"}) {
      json& entries = one.at(list);
      all.at(list).insert(all.at(list).end(), entries.begin(), entries.end());
    }
  }
  for (const std::string& death : children.deaths()) all.at("notes").push_back(death);
  all["failed"] = children.failures();
  if (!all_is_served(states, is_countable)) {
    all.at("notes").push_back(
        fmt::format("messages were still under way between processes {} s after the last timer",
                    kDrainLimit.count()));
  }
  return all;
}

}  // namespace

json run_processes(const std::vector<SystemDescription>& processes,
                   const ContainerOverrides& overrides, Nanoseconds duration, bool loads) {
  const auto roudi = start_roudi(processes, overrides);  // ends after its clients
  const EndSignals signals;
  // A process of its own says goodbye to our RouDi before that ends.
  json result = processes.size() == 1 && (roudi == nullptr || loads)
                    ? run_here(processes.front(), overrides, duration, signals, loads)
                    : run_apart(processes, overrides, duration, signals);
  for (json& callback : result.at("callbacks")) callback.erase("from_outside");
  result.emplace("failed", json::array());
  return result;
}

}  // namespace takt::tools
