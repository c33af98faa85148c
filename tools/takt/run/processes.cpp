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

#include "takt/base/error.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/measuring/row_json.hpp"

#include "exit_status.hpp"
#include "run/child.hpp"
#include "run/deliveries.hpp"
#include "run/end_signals.hpp"
#include "run/latencies_over_time.hpp"
#include "run/process_state.hpp"
#include "run/progress.hpp"
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
    const TimePoint look = container.watch_bounds();
    const timespec time = to_timespec(std::min({progress.show(now), check - now, look - now}));
    ppoll(&events, 1, &time, nullptr);
    if (const int signal = signals.take(); signal != 0) return signal;
  }
  return 0;
}

FinishedRun run_here(SystemDescription system, ContainerOverrides overrides, Nanoseconds duration,
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
  ProcessResult result = container.result();
  FinishedRun finished{.failed = std::move(result.failures), .signal = end == SIGUSR1 ? 0 : end};
  finished.run = rt::run_of(std::move(result));
  finished.run.over_time = combined_over_time({slices_json(overrides.slices.get())});
  add_topics(finished.run, system.name, state_of(container, false).endpoints);
  return finished;
}

std::vector<ProcessState> states_of(const std::vector<json>& answers) {
  std::vector<ProcessState> states(answers.size());
  for (std::size_t i = 0; i < answers.size(); ++i) {
    rt::read_value(answers[i], states[i], {nullptr, "the state of a process"});
  }
  return states;
}

bool is_any_pending(const std::vector<ProcessState>& processes) {
  return std::any_of(processes.begin(), processes.end(),
                     [](const ProcessState& process) { return process.pending != 0; });
}

/// Waits until all messages are served, nothing moves any more, or the time is over; returns the
/// state of all processes.
std::vector<ProcessState> drain(Supervisor& supervisor, const Countable& is_countable) {
  TimePoint moved = Clock::steady().now();
  const TimePoint limit = later(moved, kDrainLimit);
  std::vector<ProcessState> before;
  for (;;) {
    std::vector<ProcessState> now = states_of(supervisor.ask("status"));
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
  rt::Run::Process usage() const {
    const Nanoseconds cpu_time = process_cpu_time(process_) - before_;
    return {.name = name_,
            .pss_kb = proportional_set_size_kb(process_),
            .cpu_percent = 100 * rt::us(cpu_time) / rt::us(Clock::steady().now() - start_)};
  }

 private:
  const std::string name_;
  const pid_t process_;
  const TimePoint start_ = Clock::steady().now();
  const Nanoseconds before_ = process_cpu_time(process_);
};

/// Otherwise they would wait for each other in vain.
void check_that_they_meet(const SystemDescription& process, const std::vector<ProcessState>& made,
                          const std::vector<std::vector<std::uint64_t>>& matches) {
  if (!process.dds || process.dds->discovery != DiscoveryRange::off) return;
  for (std::size_t i = 0; i < made.size(); ++i) {
    for (std::size_t j = 0; j < matches[i].size() && !made[i].serves_itself; ++j) {
      if (matches[i][j] == 0) continue;
      throw Error(fmt::format("topic '{}' has its ends in several processes, which do not find "
                              "each other: `discovery: off`",
                              made[i].endpoints[j].topic),
                  "write `discovery: localhost`, or make them components of one container",
                  process.file);
    }
  }
}

FinishedRun run_apart(const std::vector<SystemDescription>& processes, const RunOptions& options,
                      pid_t roudi, const EndSignals& signals) {
  Supervisor supervisor(processes, options.words, signals);
  const std::vector<ProcessState> made = states_of(supervisor.hear());
  check_names(made);
  begin_work();
  const auto matches = count_matches(made);
  check_that_they_meet(processes.front(), made, matches);
  supervisor.ask_to_match(matches);
  supervisor.ask("start");
  supervisor.release();
  std::vector<Attendant> attendants{{"takt", 0}};
  if (roudi != 0) attendants.emplace_back("iox-roudi", roudi);
  supervisor.watch(options.duration);
  supervisor.bound_end(uses_shared_memory(made));
  supervisor.ask("hold");
  std::vector<rt::Run::Process> usages;
  for (const Attendant& attendant : attendants) usages.push_back(attendant.usage());
  const Countable is_countable(ends_of(made), [&] { return supervisor.are_complete(); });
  const std::vector<ProcessState> states = drain(supervisor, is_countable);
  const Ends ends = ends_of(states);
  const auto sent = count_sent(states);
  supervisor.ask("shut_down");
  const std::vector<json> answers = supervisor.ask("stop");

  FinishedRun all{.failed = supervisor.failures(), .signal = supervisor.signal()};
  std::vector<json> parts;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    rt::Run one = rt::read_run(answers[i].at("run"), "the run of a process");
    parts.push_back(answers[i].at("over_time"));
    complete_callbacks(one.callbacks, states[i].endpoints, sent[i], ends, is_countable);
    add_topics(one, one.processes.at(0).name, states[i].endpoints);
    all.run.duration_s = one.duration_s;
    merge(all.run, one);
    add_to(all.failed, answers[i].at("failed").get<std::vector<std::string>>());
  }
  all.run.over_time = combined_over_time(parts);
  add_to(all.run.processes, usages);
  add_to(all.run.notes, supervisor.deaths());
  if (!all_is_served(states, is_countable)) {
    all.run.notes.emplace_back("messages were still in transit between processes at the end");
  }
  return all;
}

}  // namespace

void give_attributes(const EndSignals& signals, const SystemDescription& system) {
  const ThreadDescription* const thread = find_thread(system, "signals");
  if (thread == nullptr) return;
  ThreadState state;
  try {
    signals.run_in_thread([&] { state = apply(thread->attributes, system.realtime); });
  } catch (const Error& error) {
    throw std::runtime_error(error.what());  // the machine's, no mistake in the file
  }
  if (!state.refused.empty()) rt::to_stderr("note: {}\n", state.refused);
}

FinishedRun run_processes(const std::vector<SystemDescription>& processes,
                          const RunOptions& options) {
  const auto roudi = start_roudi(processes, options.overrides);  // ends after its clients
  EndSignals signals;
  give_attributes(signals, processes.front());
  // With RouDi in a separate process, which unregisters from RouDi before RouDi ends.
  const bool is_apart =
      processes.size() > 1 || options.apart || (roudi != nullptr && !options.loads);
  return is_apart ? run_apart(processes, options, roudi != nullptr ? roudi->pid() : 0, signals)
                  : run_here(processes.front(), options.overrides, options.duration, signals,
                             options.loads);
}

}  // namespace takt::tools
