// SPDX-License-Identifier: Apache-2.0
#include "run/processes.hpp"

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
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "run/channel.hpp"
#include "run/end_signals.hpp"
#include "run/result_json.hpp"
#include "run/shared_memory.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kMatchLimit = 10s;
constexpr auto kDrainLimit = 5s;
constexpr auto kDiscoveryTime = 10s;  // then those who run know each other
constexpr auto kSharedMemoryEndLimit = 30s;

// ---- Waiting ----

timespec to_timespec(Nanoseconds time) {
  time = std::max(time, 0ns);
  return {time / 1s, (time % 1s).count()};
}

/// Shows how much of a run is over, on a terminal.
class Progress {
 public:
  explicit Progress(Nanoseconds duration)
      : duration_(duration), is_shown_(isatty(STDERR_FILENO) != 0 && duration > 2s) {}
  ~Progress() {
    if (is_shown_) rt::to_stderr("\r                    \r");
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  TimePoint end() const { return duration_ == Nanoseconds::zero() ? kNever : start_ + duration_; }
  /// Shows it now; returns how long one may sleep.
  Nanoseconds show(TimePoint now) const {
    Nanoseconds step = end() == kNever ? std::chrono::hours(24) : end() - now;
    if (is_shown_) {
      rt::to_stderr("\r{:.0f} of {:.0f} s ", std::chrono::duration<double>(now - start_).count(),
                    std::chrono::duration<double>(duration_).count());
      step = std::min<Nanoseconds>(step, 1s);
    }
    return step;
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

json nodes_json(const Container& container) {
  json result = json::array();
  for (const LoadedComponent& component : container.components()) {
    result.push_back({component.name, component.type, component.where});
  }
  return result;
}

/// Throws the ConfigurationError that names nodes of one name.
void check_names(const std::vector<json>& processes) {
  std::vector<LoadedComponent> components;
  for (const json& process : processes) {
    for (const json& node : process.at("nodes")) {
      components.push_back({.name = node[0], .type = node[1], .where = node[2]});
    }
  }
  const std::vector<std::string> errors = name_conflicts(components);
  if (!errors.empty()) throw ConfigurationError(errors);
}

// ---- One process ----

/// Until the time is up: 0; or a signal comes, which it returns.
int wait_for_end(Nanoseconds duration, const EndSignals& signals, Container& container) {
  const Progress progress(duration);
  TimePoint check = Clock::steady().now() + kDiscoveryTime;
  pollfd events{signals.fd(), POLLIN, 0};
  for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
    if (now >= check) {
      container.check_matches();
      check = kNever;
    }
    const timespec time = to_timespec(std::min(progress.show(now), check - now));
    if (ppoll(&events, 1, &time, nullptr) > 0) return signals.take();
  }
  return 0;
}

json run_here(SystemDescription system, ContainerOverrides overrides, Nanoseconds duration,
              const EndSignals& signals, bool loads) {
  std::vector<ComponentDescription> later;
  if (loads) later.swap(system.components);
  EndGuard guard;
  overrides.on_making = [&guard](std::string_view component) { guard.making(component); };
  guard.begins(signals);
  Container container(system, overrides);
  if (guard.signal() == 0) container.start([] { kill(getpid(), SIGUSR1); });
  // What load_node does; that the request came from outside leaves no trace in what is measured.
  for (ComponentDescription& component : later) {
    if (guard.signal() == 0) container.load(std::move(component));
  }
  int end = guard.has_begun();
  if (end != 0 && end != SIGUSR1) {
    signals.let_through();
    throw std::runtime_error(name_of_signal(end) + " came before the run had begun");
  }
  container.release();
  if (end == 0) end = wait_for_end(duration, signals, container);
  signals.let_through();
  guard.ends(end);
  container.hold();
  container.shut_down();
  container.stop();
  json result = process_json(container.result());
  add_topics(result["topics"] = json::array(), system.name, endpoints_json(container));
  return result;
}

// ---- Several: the child ----

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
int serve(const SystemDescription& system, ContainerOverrides overrides, int socket) {
  Channel parent(socket);
  try {
    const int failed = eventfd(0, EFD_CLOEXEC);
    EndGuard guard;  // the parent looks after the beginning
    overrides.on_making = [&guard](std::string_view component) { guard.making(component); };
    Container container(system, overrides);
    const bool serves_itself = system.dds && system.dds->serves_own_process;
    const auto ends = [&]() -> json {
      return {{"endpoints", endpoints_json(container)},
              {"nodes", nodes_json(container)},
              {"serves_itself", serves_itself}};
    };
    parent.send(ends());
    TimePoint check = kNever;
    for (;;) {
      std::array<pollfd, 2> news{{{parent.fd(), POLLIN, 0}, {failed, POLLIN, 0}}};
      const TimePoint now = Clock::steady().now();
      if (now >= check) {
        container.check_matches();
        check = kNever;
      }
      const timespec time = to_timespec(check - now);
      ppoll(news.data(), news.size(), check == kNever ? nullptr : &time, nullptr);
      if (news[1].revents != 0) {
        guard.ends(0);
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
        check = Clock::steady().now() + kDiscoveryTime;
      } else if (word == "hold") {
        check = kNever;
        guard.ends(0);
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
  } catch (...) {
    Logger::instance().flush();
    parent.send({{"error", kNoStdException}});
  }
  return 1;
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
    is_ending_ = true;
    for (const auto& child : children_) {
      if (child->channel) child->channel->finish();  // who still runs sees this end
    }
    const TimePoint limit = Clock::steady().now() + kConstructorLimit;
    bool has_said = false;
    while (end_some()) {
      const TimePoint now = Clock::steady().now();
      const std::string unmade = unmade_children();
      if (!unmade.empty() && !std::exchange(has_said, true)) {
        rt::to_stderr("takt: waiting for constructors of process {}, {} s at most\n", unmade,
                      kConstructorLimit.count());
      }
      if (!unmade.empty() && now >= limit) {
        end_now([](const Child& child) { return !child.is_made; }, "has not been made in time");
      } else if (now >= limit_) {
        end_now([](const Child&) { return true; }, "it does not end");
        limit_ = kNever;
      } else if (const int signal = signals_.take(); signal != 0) {
        end_now([](const Child&) { return true; }, name_of_signal(signal) + " came again");
      }
      const TimePoint next = std::min({now + 1h, limit_, unmade.empty() ? kNever : limit});
      pump(next - now);
    }
  }
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// What each says to begin with, or answers to the command. All are asked before any is heard.
  /// Throws Error when one has ended.
  std::vector<json> hear() {
    std::vector<json> answers;
    for (const auto& child : children_) {
      if (!child->takes_part()) continue;
      answers.push_back(hear(*child));
    }
    return answers;
  }
  std::vector<json> ask(const std::string& word) {
    for (const auto& child : children_) {
      if (child->takes_part()) child->channel->send({{"do", word}});
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
  /// again, as its description says; the others go on, however long its constructors take.
  void watch(Nanoseconds duration) {
    has_run_ = true;
    const Progress progress(duration);
    for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
      TimePoint next = kNever;
      bool is_any_left = false;
      for (const auto& child : children_) {
        if (child->begin_again <= now) begin_again(*child);
        next = std::min(next, child->begin_again);
        is_any_left |= child->pid > 0 || child->begin_again != kNever;
      }
      if (!is_any_left || signals_.take() != 0) break;
      pump(std::min(progress.show(now), next - now));
      for (const auto& child : children_) {
        if (child->pid > 0) go_on(*child);
        if (child->pid > 0 && child->has_ended) bury(*child);
      }
    }
    for (const auto& child : children_) {
      child->begin_again = kNever;
      if (child->pid <= 0 || child->takes_part()) continue;
      child->death = fmt::format("process '{}' was not yet running again at the end", child->name);
      deaths_.push_back(child->death);
      child->channel->finish();
    }
  }

  /// Who has ended, and how; and of these, who was not started again.
  const std::vector<std::string>& deaths() const noexcept { return deaths_; }
  std::vector<std::string> failures() const {
    std::vector<std::string> result;
    for (const auto& child : children_) {
      if (!child->takes_part()) result.push_back(child->death);
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
        rt::to_stderr("[{}] {}\n", name, last_.back());
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
    /// It runs, and is not just being started again.
    bool takes_part() const { return pid > 0 && steps.empty(); }

    RestartOptions restart;
    pid_t pid = 0;  // 0: it does not run
    int pidfd = -1;
    bool is_made = false;           // it has said something, so its constructors have returned
    std::deque<std::string> steps;  // of its new start: those that it has not answered
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
    child.pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
    child.is_made = false;
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
    child.steps = {"make", "start", "release"};  // the first it does by itself
  }

  void go_on(Child& child) {
    while (!child.steps.empty() && answer_of(child)) {
      child.steps.pop_front();
      if (!child.steps.empty()) child.channel->send({{"do", child.steps.front()}});
    }
  }

  std::optional<json> answer_of(Child& child) {
    while (std::optional<json> answer = child.channel->next()) {
      if (!answer->contains("error")) {
        child.is_made = true;
        return answer;
      }
      child.error = answer->at("error");
    }
    return std::nullopt;
  }

  json hear(Child& child) {
    for (;;) {
      if (std::optional<json> answer = answer_of(child)) return std::move(*answer);
      if (child.has_ended && has_run_) throw std::runtime_error(end_of(child));
      if (child.has_ended) throw Error(end_of(child));  // the file may be wrong
      if (const int signal = signals_.take(); signal != 0) {
        throw std::runtime_error(fmt::format("{} came while process '{}' was awaited",
                                             name_of_signal(signal), child.name));
      }
      if (Clock::steady().now() > limit_) {
        kill(child.pid, SIGKILL);
        bound_end();  // for the others, who can end by themselves now
      }
      pump(1s);
    }
  }

  // Takes what has been written and said, for which it sleeps.
  void pump(Nanoseconds most) {
    std::vector<pollfd> news{{signals_.fd(), POLLIN, 0}};
    for (const auto& child : children_) {
      const bool listens = child->channel && !child->has_ended;
      news.push_back({listens ? child->channel->fd() : -1, POLLIN, 0});
      news.push_back({child->output.fd(), POLLIN, 0});
      news.push_back({is_ending_ ? child->pidfd : -1, POLLIN, 0});
    }
    const timespec time = to_timespec(most);
    if (ppoll(news.data(), news.size(), &time, nullptr) <= 0) return;
    for (std::size_t i = 0; i < children_.size(); ++i) {
      Child& child = *children_[i];
      if (news[3 * i + 2].revents != 0) child.output.pump(child.name);
      if (news[3 * i + 1].revents != 0) child.has_ended = !child.channel->read_some();
    }
  }

  // Takes leave of those who have ended. False: none is left.
  bool end_some() {
    bool is_any_left = false;
    for (const auto& child : children_) {
      if (child->pid <= 0) continue;
      if (child->channel) answer_of(*child);
      if (waitpid(child->pid, nullptr, WNOHANG) == 0) {
        is_any_left = true;
        continue;
      }
      forget(*child);
      while (child->output.fd() >= 0) child->output.pump(child->name);
    }
    return is_any_left;
  }
  std::string unmade_children() const {
    std::vector<std::string> names;
    for (const auto& child : children_) {
      if (child->pid > 0 && !child->is_made) names.push_back("'" + child->name + "'");
    }
    return fmt::format("{}", fmt::join(names, ", "));
  }
  template <class Predicate>
  void end_now(Predicate is_meant, const std::string& why) {
    for (const auto& child : children_) {
      if (child->pid <= 0 || !is_meant(*child)) continue;
      rt::to_stderr("takt: process '{}' is killed: {}\n", child->name, why);
      kill(child->pid, SIGKILL);
      child->is_made = true;  // it is not waited for any more
    }
  }
  static void forget(Child& child) {
    child.pid = 0;
    close(std::exchange(child.pidfd, -1));
    child.channel.reset();
    child.steps.clear();
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
    forget(child);
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
    rt::to_stderr("takt: {}\n", deaths_.back());
  }

  const ContainerOverrides overrides_;
  const EndSignals& signals_;
  TimePoint limit_ = kNever;
  std::vector<std::unique_ptr<Child>> children_;
  std::vector<std::string> deaths_;
  bool has_run_ = false, is_ending_ = false;
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
  const std::vector<json> made = children.hear();
  check_names(made);
  children.ask_to_match(count_matches(made));
  children.ask("start");
  children.ask("release");
  children.watch(duration);
  if (uses_shared_memory(made)) children.bound_end();
  children.ask("hold");
  const Countable is_countable(children, ends_of(made));
  const std::vector<json> states = drain(children, is_countable);
  const Ends ends = ends_of(states);
  const auto sent = count_sent(states);
  children.ask("shut_down");
  const std::vector<json> answers = children.ask("stop");

  json all = process_json({});
  for (const char* list :
       {"callbacks", "chains", "threads", "processes", "trace", "notes", "topics", "failed"}) {
    all[list] = json::array();
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    json one = answers[i].at("result");
    complete(one.at("callbacks"), states[i].at("endpoints"), sent[i],
             [&](const std::string& topic) { return is_countable(ends, topic); });
    all["duration_s"] = one.at("duration_s");
    add_topics(all.at("topics"), one.at("processes").at(0).at("name"), states[i].at("endpoints"));
    for (const char* list :
         {"callbacks", "chains", "threads", "processes", "trace", "notes", "failed"}) {
      json& entries = one.at(list);
      all.at(list).insert(all.at(list).end(), entries.begin(), entries.end());
    }
  }
  for (const std::string& death : children.deaths()) all.at("notes").push_back(death);
  for (const std::string& failure : children.failures()) all.at("failed").push_back(failure);
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
  return result;
}

}  // namespace takt::tools
