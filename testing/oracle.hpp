// Executors as they are specified, simulated event by event: nothing of the library runs. What
// analyses promise is compared with it, and so is what the real executors do.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_ORACLE_HPP_
#define TAKT_TESTING_ORACLE_HPP_

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "takt/analysis/system.hpp"
#include "takt/testing/oracle_machine.hpp"
#include "takt/testing/oracle_order.hpp"

namespace takt::testing {

using analysis::Time;

/// One execution, and what caused it.
struct Job {
  std::size_t callback = 0;
  Time ready = 0, start = 0, end = 0;
  Time arrival = 0;                // of what caused it, in its executor
  const Job* cause = nullptr;      // nullptr: a timer's release, or a message from outside
  std::vector<const Job*> joined;  // the other inputs of a join, whose last one is the cause
};

/// Simulates a system.
class Oracle {
 public:
  struct Run {
    std::vector<Time> phases;  // of the timers: their first releases, by callback
    std::function<Time(std::size_t callback)> execution;
    Time end = 0;
    /// From outside the system: time and callback, sorted. At the same instant they come before all
    /// else happens, or after it.
    std::vector<std::pair<Time, std::size_t>> messages{};
    bool messages_first = false;
    /// If not empty: all threads have shares or reservations, and run on these CPUs only, where
    /// what happens at one instant happens in the order of threads.
    std::vector<int> cpus{};
  };

  Oracle(const analysis::System& system, Run run)
      : system_(system),
        run_(std::move(run)),
        states_(system.callbacks.size()),
        parts_(system.executors.size()),
        machine_(run_.cpus) {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      parts_[i].executor = &system.executors[i];
      parts_[i].waiting = Waiting(system, system.executors[i].order);
      for (std::size_t thread = 0; thread < system.executors[i].threads; ++thread) {
        workers_.push_back({.part = i});
        workers_.back().awake = run_.cpus.empty();  // else it wakes up at once, in its turn
        workers_.back().awake_order = ++wake_ups_;
        if (const auto& reservation = system.executors[i].reservation) {
          workers_.back().budget = reservation->budget;
          workers_.back().deadline = reservation->period;
        }
      }
    }
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (!system.callbacks[i].is_timer) continue;
      states_[i].due = run_.phases[i];
      parts_[system.callbacks[i].executor].timers.insert({states_[i].due, i});
    }
    while (step()) {
    }
  }

  /// In order of their ends.
  const std::vector<std::unique_ptr<Job>>& jobs() const { return finished_; }

 private:
  static constexpr Time kNever = analysis::kUnbounded;

  struct Message {
    Time ready;
    std::uint64_t sequence;
    const Job* from;
    Time arrival;
    std::vector<const Job*> joined;
  };
  struct State {  // of a callback
    Time due = 0;
    std::deque<Message> messages;
    bool held = false, queued = false, drained = false;
    bool had_more = false;  // when its input was taken
    Time announced_ready = 0;
    std::uint64_t announced = 0;
    std::map<std::size_t, const Job*> inputs;  // of a join that sends to it, since the last message
  };
  struct Sent {
    const Job* from;
    std::size_t to;
    bool is_inside;
    std::vector<const Job*> joined;
  };
  struct Part {  // an executor
    const analysis::Executor* executor = nullptr;
    std::set<std::pair<Time, std::size_t>> timers;
    std::vector<std::size_t> inbox;             // announced
    std::vector<Waiting::Entry> next_snapshot;  // of a wait set
    Waiting waiting;
    std::vector<std::size_t> busy;  // groups
    std::uint64_t window = 0;
    // Of logical execution time: the next end of a period, what is sent then, and of what was taken
    // at the last one, what has not begun.
    Time next_period = 0;
    std::vector<Sent> outputs;
    std::deque<std::unique_ptr<Job>> taken;
  };
  struct Worker {
    std::size_t part = 0;
    bool awake = false, sleeping = false;
    Time waits_for = kNever;  // the release
    Time wake_time = 0, remaining = 0;
    std::uint64_t awake_order = 0;
    std::unique_ptr<Job> job;
    Time budget = 0, deadline = 0;  // of a reservation
    bool throttled = false;
  };

  const analysis::Callback& at(std::size_t callback) const { return system_.callbacks[callback]; }
  static bool is_free(const Part& part, std::size_t group) {
    return std::find(part.busy.begin(), part.busy.end(), group) == part.busy.end();
  }
  bool has_periods(const Part& part) const { return part.executor->let_period > 0; }
  bool is_shared(const Part& part) const { return part.executor->threads > 1; }

  // ---- Processors ----

  bool has_cpu(std::size_t index) const {
    const Worker& self = workers_[index];
    if (self.throttled) return false;
    if (!parts_[self.part].executor->share && run_.cpus.empty()) return true;
    return std::find(running_.begin(), running_.end(), index) != running_.end();
  }
  void give_cpus() {
    std::vector<MachineThread> threads;
    for (const Worker& worker : workers_) {
      const auto& share = parts_[worker.part].executor->share;
      threads.push_back({worker.awake, worker.throttled, is_reserved(worker), worker.awake_order,
                         share ? &share->cpus : nullptr,
                         share ? -share->priority : worker.deadline});
    }
    running_ = run_.cpus.empty() ? beside_reservations(threads) : machine_.running(threads);
  }
  // When something happens to it, if nothing happens before.
  Time next_event(std::size_t index) const {
    const Worker& worker = workers_[index];
    if (worker.throttled) return worker.deadline;
    if (!worker.awake) return worker.wake_time;
    if (!has_cpu(index)) return kNever;
    const Time end = now_ + worker.remaining;
    return is_reserved(worker) ? std::min(end, now_ + worker.budget) : end;
  }
  bool is_reserved(const Worker& worker) const {
    return parts_[worker.part].executor->reservation.has_value();
  }
  bool step() {
    give_cpus();
    std::size_t first = SIZE_MAX;
    std::pair<Time, bool> first_time{kNever, true};
    const bool ends_first =
        !run_.cpus.empty() || std::any_of(parts_.begin(), parts_.end(), [](const Part& part) {
          return part.executor->share.has_value();
        });
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      // What ends now, ends before something else preempts it.
      const std::pair time(next_event(i), ends_first && !workers_[i].awake);
      if (time < first_time) {
        first = i;
        first_time = time;
      }
    }
    const Time message = messages_ < run_.messages.size() ? run_.messages[messages_].first : kNever;
    const bool is_message =
        message < first_time.first || (message == first_time.first && run_.messages_first);
    const Time time = std::min(message, first_time.first);
    if (time >= kNever || time > run_.end) return false;
    const Time elapsed = std::max<Time>(0, time - now_);
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = workers_[i];
      if (!worker.awake || !has_cpu(i)) continue;
      worker.remaining -= elapsed;
      if (is_reserved(worker)) worker.budget -= elapsed;
    }
    now_ += elapsed;
    if (is_message) {
      deliver({nullptr, run_.messages[messages_++].second, false, {}});
    } else {
      happens(first);
    }
    return true;
  }
  void happens(std::size_t index) {
    Worker& worker = workers_[index];
    const auto& reservation = parts_[worker.part].executor->reservation;
    if (worker.throttled) {
      worker.throttled = false;
      worker.budget = reservation->budget;
      worker.deadline += reservation->period;
      return;
    }
    if (!worker.awake) return wake_up(worker);
    if (worker.remaining > 0) {  // the budget is used up
      worker.throttled = true;
      return;
    }
    go_on(index);
  }
  void wake_up(Worker& worker) {
    worker.awake = true;
    worker.awake_order = ++wake_ups_;
    worker.remaining = 0;
    const auto& reservation = parts_[worker.part].executor->reservation;
    if (!reservation) return;
    const Time left = worker.deadline - now_;
    if (left <= 0 || worker.budget * reservation->period > left * reservation->budget) {
      worker.budget = reservation->budget;
      worker.deadline = now_ + reservation->period;
    } else if (worker.budget == 0) {
      worker.throttled = true;
    }
  }

  // ---- A worker ----

  void go_on(std::size_t index) {
    Worker& worker = workers_[index];
    Part& part = parts_[worker.part];
    if (worker.job != nullptr) {
      finish(worker, part);
    } else {
      end_sleep(index);
    }
    while (!run_next(worker, part) && sleep(index)) {
    }
  }
  // Returns true if it goes on at once.
  bool sleep(std::size_t index) {
    Worker& worker = workers_[index];
    Part& part = parts_[worker.part];
    Time deadline = kNever;
    if (has_periods(part)) {
      block(worker, part.next_period);
      return false;
    }
    if (nobody_waits_for_first(part)) deadline = worker.waits_for = part.timers.begin()->first;
    if (part.inbox.empty() && deadline > now_) {
      block(worker, deadline);
      return false;
    }
    end_sleep(index);
    return true;
  }
  void block(Worker& worker, Time deadline) {
    worker.awake = false;
    worker.sleeping = true;
    worker.wake_time = analysis::plus(deadline, system_.overheads.wake);
  }
  // Whether no worker waits for the first release, or for an earlier one.
  bool nobody_waits_for_first(const Part& part) const {
    return !part.timers.empty() && std::none_of(workers_.begin(), workers_.end(), [&](auto& other) {
      return &parts_[other.part] == &part && other.waits_for <= part.timers.begin()->first;
    });
  }
  void end_sleep(std::size_t index) {
    Worker& worker = workers_[index];
    worker.sleeping = false;
    worker.waits_for = kNever;
  }
  void wake(std::size_t part) {
    const auto sleeper = std::find_if(workers_.begin(), workers_.end(), [&](const Worker& worker) {
      return worker.part == part && worker.sleeping;
    });
    if (sleeper == workers_.end()) return;
    sleeper->sleeping = false;
    sleeper->wake_time = std::min(sleeper->wake_time, now_ + system_.overheads.wake);
  }
  void pass_on(Part& part) {
    if (!is_shared(part)) return;
    if (!part.waiting.is_empty() || !part.next_snapshot.empty() || !part.inbox.empty() ||
        nobody_waits_for_first(part)) {
      wake(static_cast<std::size_t>(&part - parts_.data()));
    }
  }
  bool run_next(Worker& worker, Part& part) {
    if (has_periods(part)) return run_period(worker, part);
    Waiting::Entry entry{};
    for (;;) {
      if (!part.executor->is_wait_set || part.waiting.is_empty()) poll(part);
      if (part.waiting.is_empty()) return false;
      entry = part.waiting.pop();
      part.window = std::max(part.window, entry.window);
      const std::size_t group = at(entry.callback).group;
      if (is_free(part, group)) {
        part.busy.push_back(group);
        break;
      }
      part.waiting.park(entry);
    }
    pass_on(part);
    begin(worker, take(entry));
    return true;
  }
  bool run_period(Worker& worker, Part& part) {
    const Time period = part.executor->let_period;
    if (part.taken.empty()) {
      if (part.next_period == 0) part.next_period = now_ + period;
      if (now_ < part.next_period) return false;
      for (Sent& sent : std::exchange(part.outputs, {})) deliver(std::move(sent));
      part.next_period += ((now_ - part.next_period) / period + 1) * period;
      poll(part);
      while (!part.waiting.is_empty()) part.taken.push_back(take(part.waiting.pop()));
      if (part.taken.empty()) return false;
    }
    begin(worker, std::move(part.taken.front()));
    part.taken.pop_front();
    return true;
  }
  void begin(Worker& worker, std::unique_ptr<Job> job) {
    job->start = now_;
    worker.remaining = run_.execution(job->callback) + system_.overheads.dispatch;
    worker.job = std::move(job);
  }
  std::unique_ptr<Job> take(const Waiting::Entry& entry) {
    State& state = states_[entry.callback];
    auto taken = std::make_unique<Job>();
    Job& job = *taken;
    job.callback = entry.callback;
    if (at(entry.callback).is_timer) {
      job.ready = job.arrival = state.due;
      const Time period = at(entry.callback).arrivals->least_distance(2);
      state.due += ((now_ - state.due) / period + 1) * period;
    } else {
      const Message message = state.messages.front();
      state.messages.pop_front();
      state.had_more = !state.messages.empty();
      job.ready = message.ready;
      job.cause = message.from;
      job.arrival = message.arrival;
      job.joined = message.joined;
    }
    return taken;
  }
  void finish(Worker& worker, Part& part) {
    const std::size_t callback = worker.job->callback;
    worker.job->end = now_;
    finished_.push_back(std::move(worker.job));
    const Job& job = *finished_.back();
    for (const analysis::Output& output : at(callback).outputs) {
      if (output.waits) {
        join(job, output.to);
        continue;
      }
      const bool is_inside = at(callback).executor == at(output.to).executor;
      for (analysis::Count i = 0; i < output.messages; ++i) send({&job, output.to, is_inside, {}});
    }
    settle(part, callback);
    const std::size_t group = at(callback).group;
    std::erase(part.busy, group);
    part.waiting.unpark(group);
  }
  void join(const Job& job, std::size_t to) {
    auto& inputs = states_[to].inputs;
    inputs[job.callback] = &job;
    const auto sends_there = [to](const analysis::Callback& callback) {
      return std::any_of(callback.outputs.begin(), callback.outputs.end(),
                         [to](const auto& output) { return output.to == to && output.waits; });
    };
    const auto senders =
        std::count_if(system_.callbacks.begin(), system_.callbacks.end(), sends_there);
    if (static_cast<std::ptrdiff_t>(inputs.size()) < senders) return;
    inputs.erase(job.callback);
    std::vector<const Job*> others;
    for (const auto& [sender, input] : std::exchange(inputs, {})) others.push_back(input);
    send({&job, to, false, std::move(others)});
  }
  void send(Sent sent) {
    Part& part = parts_[at(sent.from->callback).executor];
    if (!has_periods(part)) return deliver(std::move(sent));
    part.outputs.push_back(std::move(sent));
  }
  void deliver(Sent sent) {
    const std::size_t to = sent.to;
    State& state = states_[to];
    Part& part = parts_[at(to).executor];
    const bool is_from_here =
        sent.from != nullptr && at(sent.from->callback).executor == at(to).executor;
    const std::uint64_t sequence = ++sequence_;
    const Time arrival = sent.is_inside ? sent.from->arrival : now_;
    state.messages.push_back({now_, sequence, sent.from, arrival, std::move(sent.joined)});
    if (is_from_here && !is_shared(part)) {  // from this worker
      if (!state.held && !state.queued) enqueue(part, to, now_, sequence);
      return;
    }
    // Another worker is of no use for what waits for this callback's group.
    const bool wakes =
        is_from_here ? at(sent.from->callback).group != at(to).group : !has_periods(part);
    if (announce(part, to, now_, sequence) && wakes) wake(at(to).executor);
  }

  // ---- What is ready ----

  bool announce(Part& part, std::size_t callback, Time ready, std::uint64_t sequence) {
    State& state = states_[callback];
    if (std::exchange(state.queued, true)) return false;
    state.announced_ready = ready;
    state.announced = sequence;
    part.inbox.push_back(callback);
    return true;
  }
  void hold(Part& part, std::size_t callback, Time ready, std::uint64_t sequence) {
    states_[callback].held = true;
    const std::uint64_t ahead = part.executor->is_wait_set ? 0 : 1;
    part.waiting.push({callback, ready, sequence, part.window + ahead});
  }
  void drain(Part& part) {
    for (const std::size_t callback : std::exchange(part.inbox, {})) {
      State& state = states_[callback];
      state.drained = true;
      if (state.held) continue;
      state.held = true;
      add(part, callback, state.announced_ready, state.announced);
    }
  }
  void add(Part& part, std::size_t callback, Time ready, std::uint64_t sequence) {
    if (part.executor->is_wait_set) {
      part.next_snapshot.push_back({callback, ready, sequence, 0});
    } else {
      part.waiting.push({callback, ready, sequence, part.window + 1});
    }
  }
  // A worker has found it ready: nobody has announced it, so who does next announces it anew.
  void enqueue(Part& part, std::size_t callback, Time ready, std::uint64_t sequence) {
    if (part.executor->is_wait_set) drain(part);  // they came before
    states_[callback].held = true;
    add(part, callback, ready, sequence);
  }
  void poll(Part& part) {
    if (part.executor->is_wait_set) ++part.window;
    drain(part);
    for (Waiting::Entry& entry : std::exchange(part.next_snapshot, {})) {
      entry.window = part.window;
      part.waiting.push(entry);
    }
    while (!part.timers.empty() && part.timers.begin()->first <= now_) {
      const auto [due, callback] = *part.timers.begin();
      part.timers.erase(part.timers.begin());
      hold(part, callback, due, ++sequence_);
    }
  }
  void settle(Part& part, std::size_t callback) {
    State& state = states_[callback];
    if (at(callback).is_timer) {
      state.held = false;
      part.timers.insert({state.due, callback});
      return;
    }
    bool more = std::exchange(state.had_more, false);
    if (!more && std::exchange(state.drained, false)) {
      state.queued = false;
      more = !state.messages.empty();
    }
    if (!more) {  // what has come meanwhile is in the inbox
      state.held = false;
      return;
    }
    const Message& front = state.messages.front();
    enqueue(part, callback, front.ready, front.sequence);
  }

  const analysis::System& system_;
  const Run run_;
  Time now_ = 0;
  std::uint64_t sequence_ = 0;
  std::size_t messages_ = 0;  // from outside: how many have come
  std::vector<State> states_;
  std::vector<Part> parts_;
  std::vector<Worker> workers_;       // by rank
  std::vector<std::size_t> running_;  // of those that share CPUs
  Machine machine_;                   // of the CPUs, if there are some
  std::uint64_t wake_ups_ = 0;
  std::vector<std::unique_ptr<Job>> finished_;
};

}  // namespace takt::testing

#endif  // TAKT_TESTING_ORACLE_HPP_
