// SPDX-License-Identifier: Apache-2.0
#include "run/processes.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "takt/containers/process_usage.hpp"
#include "takt/measuring/process_json.hpp"
#include "takt/measuring/rounds.hpp"

#include "exit_status.hpp"
#include "run/child.hpp"
#include "run/container_json.hpp"
#include "run/deliveries.hpp"
#include "run/end_signals.hpp"
#include "run/latencies_over_time.hpp"
#include "run/progress.hpp"
#include "run/result_json.hpp"
#include "run/shared_memory.hpp"
#include "run/supervisor.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kDrainLimit = 5s;
constexpr auto kStillLimit = 1s;  // what has not moved for so long is lost

// ---- One process ----

/// Waits for this time and returns 0, or returns a signal when it arrives.
int wait_for_end(Nanoseconds duration, const EndSignals& signals, Container& container) {
  Progress progress(duration);
  TimePoint check = later(Clock::steady().now(), kDiscoveryTime);
  pollfd events{signals.fd(), POLLIN, 0};
  for (TimePoint now; (now = Clock::steady().now()) < progress.end();) {
    if (now >= check) {
      container.check_matches();
      check = kNever;
    }
    const timespec time = to_timespec(std::min(progress.show(now), check - now));
    ppoll(&events, 1, &time, nullptr);
    if (const int signal = signals.take(); signal != 0) return signal;
  }
  return 0;
}

json run_here(SystemDescription system, ContainerOverrides overrides, Nanoseconds duration,
              EndSignals& signals, bool loads) {
  std::vector<ComponentDescription> later;
  if (loads) later.swap(system.components);
  EndGuard guard(signals);
  overrides.on_making = [&guard](std::string_view component) { guard.making(component); };
  overrides.end = [] { kill(getpid(), SIGUSR1); };
  Container container(system, overrides);
  begin_work();  // what the file says could be made
  if (const int signal = guard.signal(); signal == 0 || signal == SIGUSR1)
    container.start(overrides.end);
  // Does what load_node does, without the request, which would add to the measurement.
  for (ComponentDescription& component : later) {
    if (guard.signal() == 0) container.load(std::move(component));
  }
  if (const int signal = guard.signal(); signal != 0 && signal != SIGUSR1) {
    throw Interrupted(signal, " before the run had started");
  }
  int end = guard.has_begun();
  container.release();
  if (end == 0) end = wait_for_end(duration, signals, container);
  guard.ends(end);
  container.hold();
  container.shut_down();
  container.stop();
  json result = rt::process_json(container.result());
  result["over_time"] = combined_over_time({slices_json(overrides.slices.get())});
  add_topics(result["topics"] = json::array(), system.name, endpoints_json(container));
  result["signal"] = end == SIGUSR1 ? 0 : end;
  return result;
}

bool is_any_pending(const std::vector<json>& processes) {
  return std::any_of(processes.begin(), processes.end(),
                     [](const json& process) { return process.at("pending") != 0; });
}

/// Waits until all messages are served, nothing moves any more, or the time is over; returns the
/// state of all processes.
std::vector<json> drain(Supervisor& supervisor, const Countable& is_countable) {
  TimePoint moved = Clock::steady().now();
  const TimePoint limit = later(moved, kDrainLimit);
  std::vector<json> before;
  for (;;) {
    std::vector<json> now = supervisor.ask("status");
    const TimePoint time = Clock::steady().now();
    if (now != before || is_any_pending(now)) moved = time;
    // Require the same result twice: a message can be in transit from a process that was queried
    // late to one that was queried early.
    if ((all_is_served(now, is_countable) && now == before) || time > limit ||
        time - moved > kStillLimit) {
      return now;
    }
    before = std::move(now);
    std::this_thread::sleep_for(5ms);
  }
}

/// A process that has no components, but whose memory and CPU time the system needs, too.
class Attendant {
 public:
  Attendant(std::string name, pid_t process) : name_(std::move(name)), process_(process) {}
  /// Of the measured time.
  json usage() const {
    const Nanoseconds cpu_time = process_cpu_time(process_) - before_;
    return {{"name", name_},
            {"pss_kb", proportional_set_size_kb(process_)},
            {"cpu_percent", 100 * rt::us(cpu_time) / rt::us(Clock::steady().now() - start_)},
            {"allocations_while_spinning", json()},
            {"allocations_in_dds", json()}};
  }

 private:
  const std::string name_;
  const pid_t process_;
  const TimePoint start_ = Clock::steady().now();
  const Nanoseconds before_ = process_cpu_time(process_);
};

json run_apart(const std::vector<SystemDescription>& processes, const RunOptions& options,
               pid_t roudi, const EndSignals& signals) {
  Supervisor supervisor(processes, options.words, signals);
  const std::vector<json> made = supervisor.hear();
  check_names(made);
  begin_work();
  supervisor.ask_to_match(count_matches(made));
  supervisor.ask("start");
  supervisor.release();
  std::vector<Attendant> attendants{{"takt", 0}};
  if (roudi != 0) attendants.emplace_back("iox-roudi", roudi);
  supervisor.watch(options.duration);
  supervisor.bound_end(uses_shared_memory(made));
  supervisor.ask("hold");
  json usages = json::array();
  for (const Attendant& attendant : attendants) usages.push_back(attendant.usage());
  const Countable is_countable(ends_of(made), [&] { return supervisor.are_complete(); });
  const std::vector<json> states = drain(supervisor, is_countable);
  const Ends ends = ends_of(states);
  const auto sent = count_sent(states);
  supervisor.ask("shut_down");
  const std::vector<json> answers = supervisor.ask("stop");

  json all = rt::process_json({});
  for (const char* list : {"callbacks", "chains", "executors", "threads", "processes", "trace",
                           "notes", "topics", "failed"}) {
    all[list] = json::array();
  }
  std::vector<json> parts;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    json one = answers[i].at("result");
    parts.push_back(answers[i].value("over_time", json()));
    complete_callbacks(one.at("callbacks"), states[i].at("endpoints"), sent[i], ends, is_countable);
    all["duration_s"] = one.at("duration_s");
    add_topics(all.at("topics"), one.at("processes").at(0).at("name"), states[i].at("endpoints"));
    for (const char* list :
         {"callbacks", "chains", "executors", "threads", "processes", "trace", "notes", "failed"}) {
      json& entries = one.at(list);
      all.at(list).insert(all.at(list).end(), entries.begin(), entries.end());
    }
  }
  all["over_time"] = combined_over_time(parts);
  for (json& usage : usages) all.at("processes").push_back(std::move(usage));
  for (const std::string& death : supervisor.deaths()) all.at("notes").push_back(death);
  for (const std::string& failure : supervisor.failures()) all.at("failed").push_back(failure);
  if (!all_is_served(states, is_countable)) {
    all.at("notes").push_back("messages were still in transit between processes at the end");
  }
  all["signal"] = supervisor.signal();
  return all;
}

}  // namespace

void give_attributes(const EndSignals& signals, const SystemDescription& system) {
  for (const ThreadDescription& thread : system.threads) {
    if (thread.attributes.name != "signals") continue;
    ThreadState state;
    signals.run_in_thread(
        [&] { state = apply(thread.attributes, std::min(system.realtime, Realtime::prefer)); });
    if (!state.refused.empty()) rt::to_stderr("note: {}\n", state.refused);
  }
}

json run_processes(const std::vector<SystemDescription>& processes, const RunOptions& options) {
  const auto roudi = start_roudi(processes, options.overrides);  // ends after its clients
  EndSignals signals;
  give_attributes(signals, processes.front());
  // With RouDi in a separate process, which unregisters from RouDi before RouDi ends.
  const bool is_apart =
      processes.size() > 1 || options.apart || (roudi != nullptr && !options.loads);
  json result = is_apart
                    ? run_apart(processes, options, roudi != nullptr ? roudi->pid() : 0, signals)
                    : run_here(processes.front(), options.overrides, options.duration, signals,
                               options.loads);
  for (json& callback : result.at("callbacks")) callback.erase("from_outside");
  const rt::Releases releases = rt::releases_of(result);
  result["releases"] = {{"due", releases.due}, {"served", releases.served}};
  return result;
}

}  // namespace takt::tools
