// The assumptions under which the measured run applies.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/model_builder.hpp"

namespace takt {

using State = Assumption::State;

void refuse_model(const MeasuredModel& model, const std::string& entry, const std::string& what) {
  const auto line = model.lines.find(entry);
  throw Error(fmt::format("'{}' contradicts the system: {}", entry, what),
              "correct it, or measure this system",
              line != model.lines.end() ? line->second : model.path);
}

namespace {

// Nothing but a timer becomes ready by itself. What a person has written need not say all: it has
// no executors.
void check_has_cause(const MeasuredModel& model, const MeasuredCallback& seen) {
  const auto& all = model.callbacks;
  const bool is_caused = std::any_of(all.begin(), all.end(), [&](const MeasuredCallback& from) {
    return from.causes.contains(seen.name);
  });
  if (is_caused || seen.executions <= seen.uncaused) return;
  if (model.lost_executions != 0 || model.executors.empty()) return;
  refuse_model(model, seen.name,
               fmt::format("{} of its executions have a cause, but nothing 'causes' it",
                           seen.executions - seen.uncaused));
}

}  // namespace

// Nothing but time makes a timer ready.
void MeasuredRun::compare_timers() const {
  for (std::size_t i = 0; measured_ != nullptr && i < callbacks_.size(); ++i) {
    const MeasuredCallback* const seen = measured(i);
    if (seen == nullptr) continue;
    if (callbacks_[i]->entity->kind() != EntityKind::timer) {
      check_has_cause(*measured_, *seen);
      continue;
    }
    if (seen->uncaused != 0) {
      refuse_model(*measured_, seen->name,
                   "it is a timer, which has no executions that are 'uncaused'");
    }
    for (const MeasuredCallback& from : measured_->callbacks) {
      if (!from.causes.contains(seen->name)) continue;
      refuse_model(*measured_, from.name, fmt::format("it 'causes' '{}', a timer", seen->name));
    }
  }
}

// How many executions of the callback its senders in the system explain, by what they have sent;
// nullopt: not all of them are known.
std::optional<std::uint64_t> MeasuredRun::explained(std::size_t index) const {
  if (measured_->lost_executions != 0) return {};
  std::uint64_t result = 0;
  std::optional<std::uint64_t> joined;  // by a join, as many as its rarest input has
  const std::set<std::size_t> once(topics_.senders(index).begin(), topics_.senders(index).end());
  for (const std::size_t from : once) {
    const MeasuredCallback* const sender = measured(from);
    if (sender == nullptr) return {};
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (output.to != index) continue;
      const analysis::Count messages = output.waits ? joined_.at(index) : output.messages;
      const std::uint64_t sent = sender->executions * static_cast<std::uint64_t>(messages);
      if (output.waits) {
        joined = std::min(joined.value_or(sent), sent);
      } else {
        result += sent;
      }
    }
  }
  return result + joined.value_or(0);
}

void MeasuredRun::find_executors_then() {
  static const MeasuredExecutor kUnknown;
  std::map<std::string_view, const MeasuredExecutor*> known;
  for (const MeasuredExecutor& executor : measured_->executors) {
    for (const std::string& callback : executor.callbacks) known.emplace(callback, &executor);
  }
  for (const analysis::Callback& callback : model_.system.callbacks) {
    const auto found = known.find(callback.name);
    then_.push_back(found != known.end() ? found->second : &kUnknown);
  }
}

// Callbacks of one single-threaded executor never wait for each other's locks; on two they may.
void MeasuredRun::add_new_neighbours() {
  std::map<std::string_view, std::set<std::size_t>> now;  // by their executor in the run
  for (std::size_t i = 0; i < callbacks_.size(); ++i)
    now[executor_then(i).name].insert(model_.system.callbacks[i].executor);
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (model_.callbacks[i].execution != Provenance::measured || executor_then(i).name.empty() ||
        now.at(executor_then(i).name).size() == 1)
      continue;
    assume_of(
        i, "as_measured",
        "{} waits for no lock of callbacks that are on other executors than its own here, and "
        "were on the same one in the measured run",
        measured_source());
  }
}

// By callback, whether it sent to receivers in the run that are not its receivers now.
std::vector<bool> MeasuredRun::find_receivers_gone() const {
  std::vector<bool> result;
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    const MeasuredCallback* const seen = measured(from);
    std::set<std::string_view> now;
    for (const analysis::Output& output : model_.system.callbacks[from].outputs)
      now.insert(model_.system.callbacks[output.to].name);
    const auto is_there = [&](const auto& cause) { return now.contains(cause.first); };
    result.push_back(seen != nullptr &&
                     !std::all_of(seen->causes.begin(), seen->causes.end(), is_there));
  }
  return result;
}

// The last receiver of a message in a process destroys it; a receiver that wants a message of its
// own gets it without a copy only if it is the last. A sender destroys the messages that it
// overwrites. So the cost of each depends on the threads of the receivers.
void MeasuredRun::add_who_destroys() {
  const auto has_moved = [&](std::size_t i) {
    const std::string& then = executor_then(i).name;
    return !then.empty() &&
           then != model_.system.executors[model_.system.callbacks[i].executor].name;
  };
  const auto assume_like = [&](std::size_t i, bool has_changed, const char* text) {
    if (model_.callbacks[i].execution != Provenance::measured) return;
    assume_of(i, has_changed ? "model_from_elsewhere" : "as_measured", text, measured_source());
  };
  const std::vector<bool> are_gone = find_receivers_gone();
  std::vector<std::vector<std::size_t>> by_process;  // receivers of one topic in each
  for (const ModelledTopic& topic : topics_.all()) {
    if (callbacks_[topic.receivers.front()]->entity->kind() != EntityKind::subscription) continue;
    std::map<const ModelledProcess*, std::vector<std::size_t>> of_topic;
    for (const std::size_t each : topic.receivers) of_topic[process_of(each)].push_back(each);
    for (auto& [process, receivers] : of_topic) by_process.push_back(std::move(receivers));
  }
  for (const auto& receivers : by_process) {
    const bool have_moved = std::any_of(receivers.begin(), receivers.end(), has_moved);
    for (const std::size_t receiver : receivers) {
      const bool had_others =
          std::any_of(topics_.senders(receiver).begin(), topics_.senders(receiver).end(),
                      [&](std::size_t from) { return are_gone[from]; });
      if (receivers.size() == 1 && !had_others) break;
      assume_like(receiver, have_moved || had_others,
                  "{} destroys or copies no more of the messages that others receive, too, or did "
                  "then, than in the measured run: the last receiver of each destroys it");
    }
  }
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (process_of(output.to) != process_of(from)) continue;
      assume_like(
          from, has_moved(output.to),
          "{} destroys no more of its messages, because others replace them before they are "
          "taken, than in the measured run");
    }
  }
}

// In the run, the messages of the callback reached their receivers in another way.
void MeasuredRun::add_how_it_sent(std::size_t callback) {
  const analysis::Callback& now = model_.system.callbacks[callback];
  const MeasuredExecutor& then = executor_then(callback);
  const bool had_period = then.type == "triggered";
  if (had_period && !now.outputs.empty() && model_.system.executors[now.executor].let_period == 0) {
    assume_of(callback, "model_from_elsewhere",
              "{} takes as long to send as in the measured run, where its executor may have sent "
              "its messages at the end of a period",
              measured_source());
  }
  const bool wakes_more =
      std::any_of(now.outputs.begin(), now.outputs.end(), [&](const analysis::Output& output) {
        return process_of(output.to) == process_of(callback) &&
               executor_then(output.to).name == then.name &&
               model_.system.callbacks[output.to].executor != now.executor;
      });
  if (wakes_more) {
    assume_of(
        callback, "as_measured",
        "{} takes as long to wake other executors as in the measured run, where its receivers "
        "were on its own",
        measured_source());
  }
}

// Senders and receivers that are in other processes now, but were in the callback's process in the
// run; or receivers in more processes than then, each of which gets a copy.
void MeasuredRun::add_other_processes(std::size_t callback) {
  const auto process_then = [&](std::size_t of) {
    const std::string name =
        executor_then(of).name;  // "process/executor"; in a run of one process "executor"
    return name.substr(0, name.rfind('/') + 1);
  };
  std::set<std::string> then;
  std::set<const ModelledProcess*> now;
  bool was_one = false;
  const auto senders = senders_elsewhere(callback);
  for (const std::size_t sender : senders)
    was_one |= process_then(sender) == process_then(callback);
  for (const analysis::Output& output : model_.system.callbacks[callback].outputs) {
    if (process_of(output.to) == process_of(callback)) continue;
    was_one |= process_then(output.to) == process_then(callback);
    now.insert(process_of(output.to));
    then.insert(process_then(output.to));
  }
  if (was_one || now.size() > then.size()) {
    assume_of(callback, "model_from_elsewhere",
              "{} takes as long to send to other processes, or to read from them, as in the "
              "measured run, where they were fewer",
              measured_source());
  } else if (!now.empty() || !senders.empty()) {
    assume_of(callback, "as_measured",
              "what {} sends to other processes, or reads from them, goes the way that it went in "
              "the measured run, by shared memory or by the network",
              measured_source());
  }
}

void MeasuredRun::add_what_was_measured(std::size_t callback) {
  assume({.id = "as_measured",
          .state = State::unchecked,
          .text = fmt::format(
              "no execution is longer than the longest that was measured, and {:g} %; none waits "
              "longer or sends more messages, and no arrivals are closer than those that were "
              "measured",
              100 * measured_->margin),
          .name = {},
          .source = measured_source(),
          .executor = model_.system.callbacks[callback].executor});
  if (process_of(callback)->is_program) {
    assume_of(callback, "model_from_elsewhere",
              "the program of {} is what it was in the measured run, as it was built and with the "
              "same arguments",
              measured_source());
  } else if (!says_all(callback)) {
    assume_of(callback, "as_measured",
              "what the library of the component of {} links, loads or reads is what it was in the "
              "measured run",
              measured_source());
  }
  add_how_it_sent(callback);
  add_other_processes(callback);
  if (measured_->differs.empty()) return;
  assume({.id = "model_from_elsewhere",
          .state = State::unchecked,
          .text = "what was measured is true here, though " + measured_->differs,
          .name = {},
          .source = "nobody",
          .executor = model_.system.callbacks[callback].executor});
}

void MeasuredRun::add_assumptions_of_model() {
  if (measured_ != nullptr) find_executors_then();
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const Provenance from = model_.callbacks[i].execution;
    if (from == Provenance::promised) {
      assume({.id = "budgets_hold",
              .state = State::checked,
              .text = "no execution is longer than its `budget`: overruns are counted, not "
                      "prevented",
              .name = {},
              .source = "declared",
              .executor = model_.system.callbacks[i].executor});
    }
    const MeasuredCallback* const seen = measured(i);
    const bool has_run = seen != nullptr && seen->executions != 0;
    if (from == Provenance::measured || has_run) add_what_was_measured(i);
  }
  if (measured_ == nullptr) return;
  add_new_neighbours();
  add_who_destroys();
  if (measured_->lost_executions == 0) return;
  assume({.id = "as_measured",
          .state = State::unchecked,
          .text = fmt::format(
              "the {} executions that the trace of the model has lost were as the others",
              measured_->lost_executions),
          .name = {},
          .source = measured_source(),
          .executor = {}});
}

}  // namespace takt
