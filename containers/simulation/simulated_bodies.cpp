// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/simulated_bodies.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/simulation/first_releases.hpp"
#include "takt/entities/staged_outputs.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/nodes/chain.hpp"

namespace takt {
namespace {

const SubscriptionBase* subscription_of(const Entity& entity) {
  return dynamic_cast<const SubscriptionBase*>(&entity);
}

[[noreturn]] void refuse_body(const std::string& callback, const std::string& why) {
  throw Error(fmt::format("'{}' cannot be simulated: {}", callback, why),
              "the code of its component does not run in a simulation; simulate takt::Workload "
              "in its place");
}

}  // namespace

StandInPublisher::StandInPublisher(Endpoint endpoint, Clock& clock)
    : writer_(std::move(endpoint), clock) {
  const MessageType& type = *writer_.endpoint().type;
  if (type.encode_defaults == nullptr) {
    throw Error(fmt::format("nothing can be sent on '{}' in a simulation: type '{}' has no message "
                            "of default values",
                            writer_.endpoint().topic, type.name),
                "use a type that TAKT_MESSAGE or a message package describes");
  }
  type.encode_defaults(bytes_);
}

void StandInPublisher::publish() {
  auto made = std::make_unique<ReceivedBlock>();
  made->from_heap = true;
  made->hold_bytes(bytes_.bytes());
  MessageBlock& block = *made.release();
  const Dispatch* const dispatch = Dispatch::current();
  if (dispatch != nullptr) {
    block.envelope.chain_instance = dispatch->chain_instance;
    block.envelope.root_release = dispatch->root_release;
    block.envelope.path = dispatch->path;
    if (dispatch->outputs != nullptr) return dispatch->outputs->add(writer_, nullptr, block);
  }
  writer_.write(block, writer_.stamp());
}

StandInPublisher& SimulatedBodies::publisher_for(const Entity& subscription) {
  auto& publisher = publishers_[{nullptr, subscription.topic()}];
  if (publisher == nullptr) {
    const Endpoint& to = subscription_of(subscription)->endpoint();
    publisher =
        std::make_unique<StandInPublisher>(Endpoint{to.topic, to.type, to.qos, "", {}}, clock_);
  }
  return *publisher;
}

// ---- Before it runs ----

void SimulatedBodies::set_up(const ModelledProcess& process, const SystemModel& model,
                             const std::vector<PlannedChain>& chains,
                             const MeasuredTimes& dispatch) {
  dispatch_ = Nanoseconds(model.system.overheads.dispatch);
  seen_dispatch_ = dispatch;
  for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
    const ModelledProcess::Callback& from = process.callbacks[i];
    Callback callback = described(from, model, i);
    if (!callback.runs) add_outputs(process, model, i, callback);
    const auto& outputs = model.system.callbacks[i].outputs;
    callback.joins = std::any_of(outputs.begin(), outputs.end(),
                                 [](const auto& output) { return output.waits; });
    callbacks_.emplace(from.entity.get(), std::move(callback));
  }
  for (const PlannedChain& chain : chains) add_chain(chain);
  recent_.resize(kMostRecent);
}

// Measures the chain from end to end: with several processes, each container knows only a piece of
// it.
void SimulatedBodies::add_chain(const PlannedChain& planned) {
  const std::size_t index = chains_.size();
  Instances& instances = chains_.emplace_back();
  instances.chain = std::make_unique<Chain>(planned.options);
  std::uint64_t path = 0;
  for (const auto& [node, name] : planned.path) {
    const Entity* const entity = node->find_entity(name).get();
    path = extend_path(path, entity->mark());
    instances.paths.push_back(path);
    Callback& callback = callbacks_.at(entity);
    callback.steps.push_back({index, path, instances.paths.size() == planned.path.size()});
    instances.joins = instances.joins || callback.joins;
  }
}

SimulatedBodies::Callback SimulatedBodies::described(const ModelledProcess::Callback& callback,
                                                     const SystemModel& model,
                                                     std::size_t index) const {
  const analysis::Callback& numbers = model.system.callbacks[index];
  const auto* component = dynamic_cast<const KnowsExecutionTimes*>(callback.node.get());
  const auto said =
      component != nullptr ? component->execution_time(callback.entity->name()) : std::nullopt;
  const Provenance provenance = model.callbacks[index].execution;
  Callback result{.name = numbers.name,
                  .least = Nanoseconds(numbers.least_execution),
                  .longest = Nanoseconds(numbers.execution) - model.callbacks[index].waits,
                  .seen = model.callbacks[index].seen,
                  .besides = {},
                  .waits = model.callbacks[index].waits,
                  .is_known = provenance != Provenance::unknown,
                  .runs = component != nullptr || running_ != nullptr,
                  .is_by_clock = provenance == Provenance::promised,
                  .joins = false,
                  .sent = {},
                  .steps = {}};
  if (said && provenance == Provenance::exact) {
    result.least = result.longest;
    result.seen = {};
  }
  if (result.runs) return result;
  const CallbackParameters parameters = callback.parameters();
  if (is_of_user(parameters.on_deadline_miss) || is_of_user(parameters.on_overrun))
    refuse_body(numbers.name, "its code has a handler of missed deadlines or overruns");
  if (dynamic_cast<const TaskRunner*>(callback.entity.get()) != nullptr)
    refuse_body(numbers.name, "it is a coroutine");
  return result;
}

// The outputs of the callback in the model: the topics of its node, and how many messages.
void SimulatedBodies::add_outputs(const ModelledProcess& process, const SystemModel& model,
                                  std::size_t index, Callback& callback) {
  const Node* const node = process.callbacks[index].node.get();
  const auto reads = [&](std::size_t to, const std::string& topic) {
    return process.callbacks[to].entity->topic() == topic;
  };
  std::map<std::string, Sent> by_topic;
  for (const analysis::Output& output : model.system.callbacks[index].outputs) {
    const Entity& to = *process.callbacks[output.to].entity;
    if (to.kind() != EntityKind::subscription) {
      refuse_body(callback.name, fmt::format("it calls or answers '{}', a service",
                                             model.system.callbacks[output.to].name));
    }
    auto& publisher = publishers_[{node, to.topic()}];
    if (publisher == nullptr) {
      const auto publishing = node->publishing_callbacks(to.topic());
      const Endpoint& end = subscription_of(to)->endpoint();
      publisher =
          std::make_unique<StandInPublisher>(Endpoint{end.topic,
                                                      end.type,
                                                      publishing && !publishing->publishers.empty()
                                                          ? publishing->publishers.front().qos
                                                          : end.qos,
                                                      node->fully_qualified_name(),
                                                      {}},
                                             clock_);
    }
    Sent& sent = by_topic[to.topic()];
    sent.publisher = publisher.get();
    if (!output.waits) {
      sent.messages = std::max<std::int64_t>(sent.messages, output.messages);
      continue;
    }
    // The index of the callback among the inputs of the join, which are callbacks of the same node.
    std::vector<std::size_t> inputs;
    for (std::size_t from = 0; from < process.callbacks.size(); ++from) {
      const auto& outputs = model.system.callbacks[from].outputs;
      if (process.callbacks[from].node.get() == node &&
          std::any_of(outputs.begin(), outputs.end(), [&](const auto& other) {
            return other.waits && reads(other.to, to.topic());
          }))
        inputs.push_back(from);
    }
    auto& join = joins_[{node, to.topic()}];
    if (join == nullptr) {
      join = std::make_unique<Join>(
          Join{std::vector<bool>(inputs.size()), std::make_unique<ChainJoin>(inputs.size())});
    }
    sent.join = join.get();
    sent.input =
        static_cast<std::size_t>(std::find(inputs.begin(), inputs.end(), index) - inputs.begin());
  }
  for (const auto& [topic, sent] : by_topic) callback.sent.push_back(sent);
}

// ---- While it runs ----

void SimulatedBodies::dispatch() noexcept {
  const Nanoseconds time =
      draws_ && seen_dispatch_.are_distributed() ? random_.one_of(seen_dispatch_) : dispatch_;
  if (time != Nanoseconds::zero()) clock_.work(time);
}

Nanoseconds SimulatedBodies::drawn(Nanoseconds least, Nanoseconds longest) {
  return draws_ ? random_.between(least, longest) : longest;
}

Nanoseconds SimulatedBodies::time_of(const Callback& callback) {
  if (draws_ && callback.seen.are_distributed()) return random_.one_of(callback.seen);
  return drawn(callback.least, callback.longest) + callback.besides;
}

void SimulatedBodies::execute(Entity& entity, Slot& slot) {
  ++executions_;
  const auto found = callbacks_.find(&entity);
  if (found == callbacks_.end()) {  // Takt's own, or made by a program at run time
    refusal_.count(entity.name());
    if (running_ != nullptr) refusal_.runs_without_time(entity.name());
    return entity.execute(slot);
  }
  refusal_.count(found->second.name);
  const TimePoint begin = clock_.now();
  run_body(found->second, entity, slot);
  note_execution(found->second, begin);
}

void SimulatedBodies::run_body(const Callback& callback, Entity& entity, Slot& slot) {
  if (!callback.is_known) refusal_.runs_without_time(callback.name);
  Nanoseconds time = time_of(callback);
  if (faults_.strikes(entity, Fault::Kind::slow)) time += (Fault::kSlowdown - 1) * callback.longest;
  if (time != Nanoseconds::zero()) callback.is_by_clock ? clock_.occupy(time) : clock_.work(time);
  if (callback.waits != Nanoseconds::zero())
    clock_.occupy(drawn(Nanoseconds::zero(), callback.waits));
  if (faults_.strikes(entity, Fault::Kind::throws)) {
    entity.discard(slot);
    throw std::runtime_error("a fault of the scenario");
  }
  if (callback.runs) return run_own_code(callback, entity, slot);
  entity.discard(slot);
  for (const Sent& sent : callback.sent) {
    if (Join* const join = sent.join; join != nullptr) {
      join->has_come[sent.input] = true;
      join->chains->received(sent.input);
      if (std::find(join->has_come.begin(), join->has_come.end(), false) != join->has_come.end())
        continue;
      join->has_come.assign(join->has_come.size(), false);
      join->chains->combine();
    }
    for (std::int64_t i = 0; i < sent.messages; ++i) sent.publisher->publish();
  }
}

void SimulatedBodies::run_own_code(const Callback& callback, Entity& entity, Slot& slot) {
  const ManualClock::CountedElsewhere counted;
  if (running_ == nullptr) return entity.execute(slot);
  const struct Running {
    std::atomic<const std::string*>& name;
    ~Running() { name.store(nullptr); }
  } running{*running_};
  running_->store(&callback.name);
  entity.execute(slot);
}

// ---- Where its chains were ----

void SimulatedBodies::note_execution(const Callback& callback, TimePoint begin) {
  const Dispatch* const dispatch = Dispatch::current();
  if (dispatch == nullptr || callback.steps.empty()) return;
  if (is_joined(dispatch->chain_instance) &&
      instance_before_joins(dispatch->chain_instance) == dispatch->chain_instance)
    ++forgotten_;
  const TimePoint end = clock_.now();
  for (const Step& step : callback.steps) {
    const auto root = root_release(*dispatch, step.path);
    if (!root) continue;
    recent_[noted_++ % kMostRecent] = {step.path, *root, begin, end};
    Instances& instances = chains_[step.chain];
    if (!step.is_last || (has_ended_ && instances.joins)) continue;
    instances.chain->finished(end - *root);
    if (end - *root <= instances.longest) continue;
    instances.longest = end - *root;
    instances.moments = {*root};
    for (const Execution& other : recent_) {
      const auto& paths = instances.paths;
      if (other.root != *root || std::find(paths.begin(), paths.end(), other.path) == paths.end())
        continue;
      instances.moments.insert(instances.moments.end(), {other.begin, other.end});
    }
  }
}

std::vector<std::vector<Nanoseconds>> SimulatedBodies::longest_instances() const {
  std::vector<std::vector<Nanoseconds>> result;
  for (const Instances& instances : chains_) {
    std::vector<Nanoseconds>& moments = result.emplace_back();
    for (const TimePoint moment : instances.moments)
      moments.push_back(between(later(kSimulationBegin, Nanoseconds(1)), moment));
  }
  return result;
}

std::vector<std::string> SimulatedBodies::notes() const {
  if (forgotten_ == 0) return {};
  return {fmt::format(
      "{} had waited for so long, behind more than {} other messages between processes or of "
      "joins, that the instances of chains that they belong to are known no more: these are not "
      "counted",
      counted(forgotten_, "message"), ChainJoin::kMostJoined)};
}

std::vector<ProcessResult::ChainResult> SimulatedBodies::chains() const {
  std::vector<ProcessResult::ChainResult> result;
  for (const Instances& instances : chains_) {
    const ChainOptions& options = instances.chain->options();
    result.push_back({options.name, options.deadline, instances.chain->statistics()});
  }
  return result;
}

}  // namespace takt
