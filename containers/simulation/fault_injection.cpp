// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/fault_injection.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/entities/subscription.hpp"

namespace takt {
namespace {

constexpr Nanoseconds kLongestDelay = std::chrono::seconds(1);

SubscriptionBase* subscription_of(const ModelledProcess::Callback& callback) {
  return callback.entity->kind() == EntityKind::subscription
             ? dynamic_cast<SubscriptionBase*>(callback.entity.get())
             : nullptr;
}

bool ends_with_exceptions(const ModelledProcess& process, const Node* node) {
  return std::none_of(process.nodes.begin(), process.nodes.end(), [&](const auto& member) {
    return member.node.get() == node && !member.ends_with_exceptions;
  });
}

const char* who_can(Fault::Kind kind) {
  if (kind == Fault::Kind::throws) return "of a component with `on_exception: ignore`";
  return kind == Fault::Kind::slow ? "a callback" : "a subscription";
}

}  // namespace

// ---- Which ----

FaultyCallbacks::FaultyCallbacks(const ModelledProcess& process, const SystemModel& model) {
  using Kind = Fault::Kind;
  for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
    const ModelledProcess::Callback& callback = process.callbacks[i];
    const std::string& name = model.system.callbacks[i].name;
    if (subscription_of(callback) != nullptr) {
      for (const Kind kind : {Kind::lost, Kind::late, Kind::doubled, Kind::reordered, Kind::full})
        names_[kind].push_back(name);
    }
    names_[Kind::slow].push_back(name);
    if (!ends_with_exceptions(process, callback.node.get())) names_[Kind::throws].push_back(name);
  }
}

std::vector<Fault> FaultyCallbacks::drawn(const FaultKinds& kinds, std::uint64_t seed,
                                          Nanoseconds duration) const {
  std::vector<Fault::Kind> possible;
  for (const Fault::Kind kind : kinds) {
    if (names_.contains(kind)) possible.push_back(kind);
  }
  std::vector<Fault> faults;
  if (possible.empty()) return faults;
  Draws draws(~seed);
  for (std::int64_t count = 1 + draws.below(3); count > 0; --count) {
    Fault fault;
    fault.kind = possible[static_cast<std::size_t>(draws.below(std::ssize(possible)))];
    const std::vector<std::string>& names = names_.at(fault.kind);
    fault.callback = names[static_cast<std::size_t>(draws.below(std::ssize(names)))];
    // In µs, so that people can read them.
    using std::chrono::microseconds;
    fault.time = microseconds(draws.below(std::max<std::int64_t>(1, duration / microseconds(1))));
    if (fault.kind == Fault::Kind::late)
      fault.span = microseconds(draws.below(kLongestDelay / microseconds(1)) + 1);
    faults.push_back(std::move(fault));
  }
  return faults;
}

void FaultyCallbacks::check(const std::vector<Fault>& faults) const {
  for (const Fault& fault : faults) {
    const auto found = names_.find(fault.kind);
    const auto names = found != names_.end() ? found->second : std::vector<std::string>();
    if (std::find(names.begin(), names.end(), fault.callback) != names.end()) continue;
    throw Error(fmt::format("the scenario has the fault '{}', and '{}' is not {}", to_string(fault),
                            fault.callback, who_can(fault.kind)),
                suggest(fault.callback, names));
  }
}

std::vector<std::string> FaultyCallbacks::notes(const FaultKinds& kinds) const {
  std::vector<std::string> result;
  for (const Fault::Kind kind : kinds) {
    if (names_.contains(kind)) continue;
    result.push_back(fmt::format("no fault `{}`: the file has no callback that is {}",
                                 to_string(kind), who_can(kind)));
  }
  return result;
}

// ---- When they happen ----

void FaultInjection::set_up(const std::vector<Fault>& faults, TimePoint begin,
                            const ModelledProcess& process, const SystemModel& model) {
  for (const Fault& fault : faults) {
    for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
      if (model.system.callbacks[i].name != fault.callback) continue;
      Pending& pending = faults_.emplace_back();
      pending.kind = fault.kind;
      pending.from = later(begin, fault.time);
      pending.until = later(pending.from, fault.span);
      pending.entity = process.callbacks[i].entity.get();
      const bool is_of_messages =
          fault.kind != Fault::Kind::slow && fault.kind != Fault::Kind::throws;
      if (!is_of_messages) continue;
      pending.reader = subscription_of(process.callbacks[i]);
      pending.reader->set_filter(*this);
    }
  }
}

bool FaultInjection::strikes(const Entity& entity, Fault::Kind kind) noexcept {
  const TimePoint now = clock_.now();
  for (Pending& fault : faults_) {
    if (fault.kind != kind || fault.entity != &entity || fault.has_struck || now < fault.from)
      continue;
    return fault.has_struck = true;
  }
  return false;
}

void FaultInjection::deliver(IntraProcessReader& reader, MessageBlock& message,
                             const Arrival& arrival, ReleasedMessages& released) noexcept {
  const TimePoint now = clock_.now();
  const auto found = std::find_if(faults_.begin(), faults_.end(), [&](const Pending& fault) {
    return fault.reader == &reader && !fault.has_struck && now >= fault.from &&
           (fault.kind != Fault::Kind::late || now < fault.until);
  });
  if (found == faults_.end()) {
    reader.deliver_now(message, arrival, released);
  } else {
    found->has_struck = found->kind != Fault::Kind::late;
    switch (found->kind) {
      case Fault::Kind::lost:
        reader.miss(1);
        return released.release(message);
      case Fault::Kind::late:
      case Fault::Kind::reordered:
        found->kept.emplace_back(&message, arrival);
        return;
      case Fault::Kind::doubled:
        repeat(reader, message, arrival, 2, released);
        break;
      default:
        repeat(reader, message, arrival, reader.endpoint().qos.depth, released);
    }
  }
  for (Pending& fault : faults_) {
    if (fault.reader == &reader && fault.kind == Fault::Kind::reordered)
      deliver_kept(fault, released);
  }
}

void FaultInjection::repeat(IntraProcessReader& reader, MessageBlock& message, Arrival arrival,
                            std::size_t times, ReleasedMessages& released) noexcept {
  for (std::size_t i = 1; i < times; ++i) message.retain();
  for (std::size_t i = 0; i < times; ++i) {
    reader.deliver_now(message, arrival, released);
    arrival.sequence = next_sequence();
  }
}

void FaultInjection::deliver_kept(Pending& fault, ReleasedMessages& released) noexcept {
  for (auto& [message, arrival] : std::exchange(fault.kept, {})) {
    arrival.sequence = next_sequence();  // arrives now; its sending time stays
    fault.reader->deliver_now(*message, arrival, released);
  }
}

std::vector<TimePoint> FaultInjection::late_times() const {
  std::vector<TimePoint> times;
  for (const Pending& fault : faults_) {
    if (fault.kind == Fault::Kind::late) times.push_back(fault.until);
  }
  return times;
}

void FaultInjection::deliver_late() {
  ReleasedMessages released;
  const ReadSection section;
  for (Pending& fault : faults_) {
    if (fault.kind == Fault::Kind::late && clock_.now() >= fault.until)
      deliver_kept(fault, released);
  }
}

void FaultInjection::end() {
  ReleasedMessages released;
  const ReadSection section;
  for (Pending& fault : faults_) {
    fault.has_struck = true;
    deliver_kept(fault, released);
  }
}

}  // namespace takt
