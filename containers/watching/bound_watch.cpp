// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/bound_watch.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/logger.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {
namespace {

using analysis::kUnbounded;

// Limit: deviations that are told apart. At it: others are counted together. Seen: "others".
constexpr std::size_t kMostDeviations = 100;

// Ticks of interrupts in a second that are negligible.
constexpr std::uint64_t kFewTicks = 1;

std::string ms(Nanoseconds time) {
  return fmt::format("{:.3f} ms", static_cast<double>(time.count()) / 1e6);
}

std::string_view id_of(Provenance times) {
  switch (times) {
    case Provenance::promised:
      return "budgets_hold";
    case Provenance::measured:
      return "as_measured";
    default:
      return "as_declared";
  }
}

bool has_senders(const SystemModel& model, std::size_t to) {
  const auto& all = model.system.callbacks;
  return std::any_of(all.begin(), all.end(), [&](const analysis::Callback& from) {
    return std::any_of(from.outputs.begin(), from.outputs.end(),
                       [&](const analysis::Output& output) { return output.to == to; });
  });
}

bool has_join(const SystemModel& model, const std::vector<std::size_t>& path) {
  return std::any_of(path.begin(), path.end(), [&](std::size_t callback) {
    const auto& outputs = model.system.callbacks[callback].outputs;
    return std::any_of(outputs.begin(), outputs.end(),
                       [](const analysis::Output& output) { return output.waits; });
  });
}

ExecutionWatch::Limits limits_of(const SystemModel& model, const ModelBounds& bounds,
                                 std::size_t index) {
  const analysis::Callback& callback = model.system.callbacks[index];
  ExecutionWatch::Limits limits;
  if (model.callbacks[index].execution != Provenance::unknown) {
    limits.execution = Nanoseconds(callback.execution + model.system.overheads.dispatch +
                                   model.system.executors[callback.executor].more_dispatch);
  }
  const analysis::Time bound = bounds.all.callbacks[index].bound;
  if (bound < kUnbounded) limits.bound = Nanoseconds(bound);
  if (callback.is_timer) {  // a component may set the releases of its timers
    limits.distances = {model.callbacks[index].period};
    return limits;
  }
  if (!callback.arrivals || has_senders(model, index)) return limits;
  const analysis::ArrivalCurve& curve = *callback.arrivals;
  if (curve.jitter() == 0) {
    const auto count = static_cast<analysis::Count>(curve.distances().size());
    for (analysis::Count i = 0; i < count; ++i) {
      limits.distances.emplace_back(curve.least_distance(i + 2));
    }
  } else {  // a jitter implies a period
    limits.distances = {Nanoseconds(curve.closest())};
    limits.period = Nanoseconds(curve.distances().front());
    limits.jitter = Nanoseconds(curve.jitter());
  }
  return limits;
}

std::vector<std::string> chains_on(const SystemModel& model, const ModelBounds& bounds,
                                   std::size_t executor) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    if (bounds.chains[i].bound && model.chains[i].executors.contains(executor)) {
      result.push_back(model.chains[i].name);
    }
  }
  return result;
}

std::uint64_t page_faults_of(int thread) {
  std::ifstream file(fmt::format("/proc/self/task/{}/stat", thread));
  std::string line;
  std::getline(file, line);
  const std::size_t name_ends = line.rfind(')');  // a name may have spaces
  if (name_ends == line.npos) return 0;
  std::istringstream rest(line.substr(name_ends + 1));
  std::string skipped;
  for (int i = 3; i < 10; ++i) rest >> skipped;
  std::uint64_t minor = 0, of_children = 0, major = 0;
  rest >> minor >> of_children >> major;
  return minor + major;
}

std::string attributes_text(const ThreadState& thread) {
  return fmt::format("{} of priority {}", to_string(thread.policy), thread.priority);
}

}  // namespace

BoundWatch::BoundWatch(const SystemModel& model, const ModelBounds& bounds,
                       const ModelledProcess& process)
    : changes_(process), sent_(model, process) {
  const bool lacks_overheads = std::any_of(
      model.assumptions.begin(), model.assumptions.end(),
      [](const Assumption& assumption) { return assumption.id == "overheads_are_zero"; });
  for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
    const SystemModel::Callback& facts = model.callbacks[i];
    const analysis::Callback& callback = model.system.callbacks[i];
    Watched& watched = callbacks_.emplace_back();
    watched.name = process.callbacks[i].node->fully_qualified_name() + "/" +
                   process.callbacks[i].entity->name();
    watched.chains = chains_on(model, bounds, callback.executor);
    const bool is_exact =
        facts.execution == Provenance::exact &&
        std::any_of(process.nodes.begin(), process.nodes.end(), [&](auto& member) {
          return member.node == process.callbacks[i].node && says_all(member);
        });
    watched.is_exact = is_exact;
    watched.times = is_exact && lacks_overheads && model.system.overheads.dispatch == 0
                        ? "overheads_are_zero"  // its component states its own work exactly
                        : std::string(id_of(facts.execution));
    watched.arrivals = process.callbacks[i].described.arrival || facts.measured_executions == 0
                           ? "as_declared"
                           : "as_measured";
    watched.outside = callback.arrivals;
    const ExecutionWatch::Limits limits = limits_of(model, bounds, i);
    watched.bound = limits.bound;
    watched.is_silent = !callback.is_timer && !callback.arrivals && !has_senders(model, i);
    watched.entity = process.callbacks[i].entity;
    watched.watch = std::make_shared<ExecutionWatch>(limits);
    process.callbacks[i].entity->set_execution_watch(watched.watch);
  }
  for (const ThreadAttributes& thread : process.threads) {
    if (!is_realtime(thread.policy)) continue;
    const std::vector<int>& its = thread.affinity.empty() ? available_cpus() : thread.affinity;
    cpus_.insert(its.begin(), its.end());
  }
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const ModelBounds::Chain& bound = bounds.chains[i];
    if (!bound.bound) continue;
    const auto& path = model.system.chains[model.chains[i].index].callbacks;
    WatchedChain& watched = chains_[model.chains[i].name];
    watched.bound = *bound.bound;
    watched.first = callbacks_[path.front()].name;
    watched.keeps = bound.why_lossy.empty() && !has_join(model, path);
    all_.push_back(model.chains[i].name);
    if (!bound.why_lossy.empty()) continue;
    for (const std::size_t callback : model.system.chains[model.chains[i].index].callbacks) {
      callbacks_[callback].must_keep.push_back(model.chains[i].name);
    }
  }
}

void BoundWatch::begin(const std::vector<int>& threads) {
  changes_.begin();
  sent_.begin();
  preemptions_.begin(threads, cpus_);
  before_ = figures(threads);
}

// ---- Looks ----

void BoundWatch::look(const std::vector<int>& threads,
                      const std::vector<CallbackStatistics>& callbacks,
                      const std::vector<std::shared_ptr<Chain>>& chains, bool is_over) {
  for (Watched& watched : callbacks_) {
    const auto counted =
        std::find_if(callbacks.begin(), callbacks.end(), [&](const CallbackStatistics& each) {
          return watched.name == each.node + "/" + each.callback;
        });
    look_at_callback(watched, counted != callbacks.end() ? *counted : CallbackStatistics(),
                     is_over);
    if (!is_over) look_at_what_waits(watched);
  }
  if (!is_over) {  // a manager has shut its nodes down by then
    for (const NodeChanges::Found& found : changes_.look())
      report("nothing_is_changed", found.of, found.text, 1, all_);
  }
  look_at_what_was_sent(callbacks);
  for (const CallbackStatistics& each : callbacks) look_at_what_is_new(each);
  for (const auto& chain : chains) look_at_chain(*chain, callbacks);
  look_at_machine(threads);
}

// The analysis has assumed that no node makes further callbacks.
void BoundWatch::look_at_what_is_new(const CallbackStatistics& counted) {
  const std::string name = counted.node + "/" + counted.callback;
  const std::string of_its_node = counted.node + "/";
  bool is_of_known_node = false;
  for (const Watched& watched : callbacks_) {
    if (watched.name == name) return;
    is_of_known_node |= watched.name.starts_with(of_its_node);
  }
  if (!is_of_known_node) return;
  report("as_declared", name, fmt::format("'{}' was made later", name), 1, all_);
}

// More than its senders explain comes from a thread of a component, or a callback sends more often
// than once.
void BoundWatch::look_at_what_was_sent(const std::vector<CallbackStatistics>& callbacks) {
  for (const SentMessages::Found& found : sent_.look(callbacks)) {
    const Watched& to = callbacks_[found.to];
    report(to.arrivals, to.name + " sent",
           fmt::format("{} messages were sent to '{}', and executions of its senders explain no "
                       "more than {}: a thread of a component sends, or a callback sends more",
                       found.sent, to.name, found.most),
           found.sent - found.most, to.chains);
  }
}

// A callback that is never served ends no execution that could be compared with its bound.
void BoundWatch::look_at_what_waits(const Watched& callback) {
  const auto entity = callback.entity.lock();
  if (callback.bound == Nanoseconds::zero() || was_let_go(entity)) return;
  Arrival arrival{};
  TimePoint since = kNever;
  if (const auto release = entity->next_release()) {
    since = *release;
  } else if (entity->front(arrival) && arrival.ready_time != TimePoint{}) {
    since = arrival.ready_time;
  }
  const TimePoint now = Clock::steady().now();
  if (since >= now || now - since <= callback.bound) return;
  report("bound", callback.name + " waits",
         fmt::format("'{}' waits for {}, and its bound is {}", callback.name, ms(now - since),
                     ms(callback.bound)),
         1, callback.chains);
}

void BoundWatch::look_at_callback(Watched& callback, const CallbackStatistics& counted,
                                  bool is_over) {
  using Kind = ExecutionWatch::Kind;
  const auto [long_ones, longest, most] = callback.watch->seen(Kind::execution);
  if (long_ones != 0) {
    report(callback.times, callback.name,
           fmt::format("'{}' took {} of processor time, and no more than {} was assumed{}",
                       callback.name, ms(longest), ms(most),
                       callback.is_exact ? ", by what is said of `dispatch` and `publish`: its own "
                                           "part is exact"
                                         : ""),
           long_ones, callback.chains);
  }
  const auto [late_ones, latest, bound] = callback.watch->seen(Kind::bound);
  if (late_ones != 0) {
    report("bound", callback.name,
           fmt::format("'{}' ended {} after its arrival, and its bound is {}", callback.name,
                       ms(latest), ms(bound)),
           late_ones, callback.chains);
  }
  const auto [close_ones, closest, least] = callback.watch->seen(Kind::arrivals);
  if (close_ones != 0) {
    report(callback.arrivals, callback.name,
           fmt::format("arrivals of '{}' came within {}, and no less than {} was assumed",
                       callback.name, ms(closest), ms(least)),
           close_ones, callback.chains);
  }
  if (callback.is_silent && counted.received > counted.from_outside) {
    report(callback.arrivals, callback.name + " runs",
           fmt::format("'{}' ran, and nothing was to come to it", callback.name), counted.received,
           all_);
  }
  look_at_what_comes_from_outside(callback, counted.from_outside);
  const std::uint64_t lost = counted.dropped + (is_over ? 0 : counted.skipped);
  if (lost != 0 && !callback.must_keep.empty()) {
    report("bound", callback.name + " lost",
           fmt::format("'{}' lost messages or releases, and none was to be lost", callback.name),
           lost, callback.must_keep);
  }
}

// Compares the number of messages between two looks. A burst in between shows only if it breaks a
// bound.
void BoundWatch::look_at_what_comes_from_outside(Watched& callback, std::uint64_t count) {
  const TimePoint now = Clock::steady().now();
  const TimePoint since = std::exchange(callback.compared, now);
  const std::uint64_t before = std::exchange(callback.from_outside, count);
  if (count <= before) return;
  if (!callback.outside) {
    report("no_other_publishers", callback.name,
           fmt::format("a process that is not of the file sent to '{}'", callback.name), count,
           callback.chains);
    return;
  }
  if (since == TimePoint{}) return;
  const auto most = static_cast<std::uint64_t>(callback.outside->most((now - since).count()));
  if (count - before <= most) return;
  report(callback.arrivals, callback.name + " from outside",
         fmt::format("{} messages came to '{}' from outside within {}, and no more than {} were "
                     "assumed",
                     count - before, callback.name, ms(now - since), most),
         counted_so_far("outside", callback.name, 1), callback.chains);
}

void BoundWatch::look_at_chain(const Chain& chain,
                               const std::vector<CallbackStatistics>& callbacks) {
  const std::string& name = chain.options().name;
  const auto known = chains_.find(name);
  if (known == chains_.end()) return;
  const auto& [bound, first, keeps] = known->second;
  const ChainStatistics seen = chain.statistics();
  if (const std::uint64_t count = chain.beyond_bound(); count != 0) {
    report("bound", name,
           fmt::format("chain '{}' took {}, and its bound is {}", name, ms(seen.latency.max()),
                       ms(bound)),
           count, {name});
  }
  constexpr std::uint64_t kOnTheWay = 2;
  for (const CallbackStatistics& counted : callbacks) {
    if (counted.node + "/" + counted.callback != first) continue;
    const std::uint64_t ended = seen.instances + seen.aborted;
    if (counted.received <= kOnTheWay + (keeps ? ended : 0) || (!keeps && ended != 0)) continue;
    report("as_declared", name + " instances",
           fmt::format("of {} instances of chain '{}', {} came through", counted.received, name,
                       seen.instances),
           1, {name});
  }
}

void BoundWatch::look_at_machine(const std::vector<int>& threads) {
  for (const Preemptions::Found& found : preemptions_.look(threads)) {
    const std::string by = found.by.empty() ? "something" : found.by;
    report(found.id, by + found.thread,
           fmt::format("{} ran before '{}', on its CPU", by, found.thread),
           counted_so_far("preempted", by + found.thread, found.count), all_);
  }
  const Figures now = figures(threads);
  look_at_threads(now);
  look_at_cpus(now);
  if (now.granted != before_.granted) {
    report("rt_runtime_as_here", "",
           fmt::format("Linux granted {} to the real-time threads of a CPU, and grants {}",
                       to_string(before_.granted), to_string(now.granted)),
           counted_so_far("throttling", "", 1), all_);
  }
  if (now.turn != before_.turn) {
    report("rt_runtime_as_here", "turn",
           fmt::format("a turn of SCHED_RR took {}, and takes {}", to_string(before_.turn),
                       to_string(now.turn)),
           counted_so_far("throttling", "turn", 1), all_);
  }
  before_ = now;
}

void BoundWatch::look_at_threads(const Figures& now) {
  for (const auto& [thread, faults] : now.page_faults) {
    const auto before = before_.page_faults.find(thread);
    if (before == before_.page_faults.end() || now.attributes.at(thread).name.empty()) continue;
    const ThreadState &is = now.attributes.at(thread), &was = before_.attributes.at(thread);
    if (is.policy != was.policy || is.priority != was.priority || is.affinity != was.affinity) {
      report("realtime_granted", is.name,
             fmt::format("thread '{}' was {} on CPU {}, and is {} on CPU {}", is.name,
                         attributes_text(was), fmt::join(was.affinity, ", "), attributes_text(is),
                         fmt::join(is.affinity, ", ")),
             counted_so_far("attributes", is.name, 1), all_);
    }
    if (faults == before->second) continue;
    report("no_page_faults", is.name,
           fmt::format("thread '{}' waited for pages of memory", is.name),
           counted_so_far("faults", is.name, faults - before->second), all_);
  }
}

void BoundWatch::look_at_cpus(const Figures& now) {
  for (const int cpu : available_cpus()) {
    const auto before = before_.ticks.find(cpu);
    const auto after = now.ticks.find(cpu);
    if (before == before_.ticks.end() || after == now.ticks.end()) continue;
    const std::uint64_t stolen = after->second.stolen - before->second.stolen;
    const std::uint64_t interrupts = after->second.interrupts - before->second.interrupts;
    if (stolen != 0) {
      report("host_not_shared", std::to_string(cpu),
             fmt::format("the host took CPU {} away; counted in ticks of 10 ms", cpu),
             counted_so_far("stolen", std::to_string(cpu), stolen), all_);
    }
    if (interrupts <= kFewTicks) continue;
    report("nothing_else_runs", fmt::format("interrupts of {}", cpu),
           fmt::format("interrupts took CPU {} away; counted in ticks of 10 ms", cpu),
           counted_so_far("interrupts", std::to_string(cpu), interrupts), all_);
  }
}

void BoundWatch::changed(const std::string& what) {
  report("nothing_is_changed", what, what, counted_so_far("changes", what, 1), all_);
}

void BoundWatch::differs(const std::string& what) {
  report("as_declared", what, what, 1, all_);
}

void BoundWatch::refused(const std::string& thread, const std::string& why) {
  report("realtime_granted", thread, why, 1, all_);
}

std::map<int, BoundWatch::Ticks> BoundWatch::ticks_of_cpus() {
  std::map<int, Ticks> result;
  std::ifstream file("/proc/stat");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("cpu") || line.starts_with("cpu ")) continue;
    std::istringstream words(line.substr(3));
    int cpu = 0;
    std::array<std::uint64_t, 8> spent{};  // user nice system idle iowait irq softirq steal
    words >> cpu;
    for (std::uint64_t& each : spent) words >> each;
    result[cpu] = {.interrupts = spent[5] + spent[6], .stolen = spent[7]};
  }
  return result;
}

BoundWatch::Figures BoundWatch::figures(const std::vector<int>& threads) {
  Figures result{.page_faults = {},
                 .attributes = {},
                 .ticks = ticks_of_cpus(),
                 .granted = realtime_grant(),
                 .turn = turn_of_round_robin()};
  for (const int thread : threads) {
    result.page_faults[thread] = page_faults_of(thread);
    result.attributes[thread] = thread_state(thread);
  }
  return result;
}

std::uint64_t BoundWatch::counted_so_far(const char* kind, const std::string& what,
                                         std::uint64_t more) {
  const std::pair key(std::string(kind), what);
  // Beyond the limit, a new deviation is one of the others, without a count of its own.
  if (counts_.size() >= kMostDeviations && !counts_.contains(key)) return more;
  return counts_[key] += more;
}

void BoundWatch::report(const std::string& id, const std::string& of, const std::string& text,
                        std::uint64_t count, const std::vector<std::string>& chains) {
  if (chains.empty()) return;  // no bound depends on it
  auto place = places_.find({id, of});
  if (place == places_.end()) {
    // An exceeded bound always has a place: their number is limited by that of callbacks and
    // chains.
    if (id != "bound" && found_.size() >= kMostDeviations) {
      if (!others_) {
        others_ = found_.size();
        found_.push_back({.id = "others", .text = "others"});
      }
      ++found_[*others_].count;
      return;
    }
    place = places_.emplace(std::pair(id, of), found_.size()).first;
    found_.push_back({.id = id, .text = text, .chains = chains});
    log(LogLevel::warn, "{} ({}): the bound{} of {} rest{} on that", text, id,
        chains.size() == 1 ? "" : "s", fmt::join(chains, ", "), chains.size() == 1 ? "s" : "");
  }
  ProcessResult::Deviation& deviation = found_[place->second];
  deviation.text = text;
  deviation.count = count;
}

}  // namespace takt
