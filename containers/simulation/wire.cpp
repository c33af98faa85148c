// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/wire.hpp"

#include <algorithm>
#include <memory>
#include <set>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/messages/cdr.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt {
namespace {

// The copy that the other process gets, so that a loan returns to the sender at once.
MessageBlock& copy_of(const MessageBlock& message, const IntraProcessReader& reader) {
  auto copy = std::make_unique<ReceivedBlock>();
  copy->from_heap = true;
  if (message.payload() != nullptr) {
    const MessageType& type = *reader.endpoint().type;
    ByteBuffer bytes;
    (type.encode != nullptr ? type : *reader.payload_type()).encode(message.payload(), bytes);
    copy->hold_bytes(bytes.bytes());
  } else {
    copy->hold_bytes(message.encoded());
  }
  copy->expire_as(message);
  copy->set_references(1);
  return *copy.release();
}

/// The instances of chains that a message belongs to, which are only known when it is sent.
std::optional<ChainJoin> instances_of(const Envelope& sent) {
  if (sent.chain_instance == 0) return std::nullopt;
  Dispatch sender{.callback = nullptr,
                  .chain_instance = sent.chain_instance,
                  .root_release = sent.root_release,
                  .path = sent.path};
  const Dispatch::Scope scope(sender);
  std::optional<ChainJoin> result(1);
  result->received(0);
  return result;
}

// As with DDS, a message from another process begins a new instance of a chain, at its sending
// time. The sender's instances continue in it like those of a join's inputs, so that chains are
// measured from end to end.
Envelope received(std::optional<ChainJoin>& sent, const Arrival& arrival) {
  Dispatch receiver{.callback = nullptr,
                    .chain_instance = arrival.sequence,
                    .root_release = arrival.ready_time,
                    .path = 0};
  Envelope envelope{.sequence = arrival.sequence, .ready_time = arrival.ready_time};
  if (!sent) return envelope;
  const Dispatch::Scope scope(receiver);
  sent->combine();
  envelope.chain_instance = receiver.chain_instance;
  envelope.root_release = receiver.root_release;
  return envelope;
}

}  // namespace

void Wire::set_up(const SystemDescription& system, std::span<const ModelledProcess> processes,
                  const SystemModel& model) {
  std::vector<std::size_t> process_of;  // by callback, in the order of the model
  std::vector<const ModelledProcess::Callback*> callbacks;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    for (const ModelledProcess::Callback& callback : processes[process].callbacks) {
      process_of.push_back(process);
      callbacks.push_back(&callback);
      auto* const reader = dynamic_cast<SubscriptionBase*>(callback.entity.get());
      if (reader == nullptr || callback.entity->kind() != EntityKind::subscription) continue;
      End& end = ends_[reader];
      end.process = process;
      if (const auto found = system.delays.find(reader->topic()); found != system.delays.end())
        end.delay = found->second;
      reader->set_filter(*this);
    }
  }
  std::set<std::string> without_delay;
  for (std::size_t from = 0; from < callbacks.size(); ++from) {
    for (const analysis::Output& output : model.system.callbacks[from].outputs) {
      if (process_of[from] == process_of[output.to]) continue;
      const Entity& to = *callbacks[output.to]->entity;
      if (to.kind() != EntityKind::subscription) {
        throw Error(
            fmt::format("cannot simulate what '{}' sends to '{}': a service between "
                        "processes",
                        model.system.callbacks[from].name, model.system.callbacks[output.to].name),
            "give both one container, or leave out the client", system.file);
      }
      if (!system.delays.contains(to.topic())) without_delay.insert(to.topic());
    }
  }
  for (const std::string& topic : without_delay) {
    notes_.push_back(fmt::format(
        "messages on '{}' between processes take no time: the topic has no `delay`", topic));
  }
}

void Wire::add_threads(std::size_t process) {
  for (const ManualClock::Use& use : clock_.use()) threads_.try_emplace(use.thread, process);
}

// A message that no thread of the processes sends comes from outside, without a delay.
void Wire::deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
                   ReleasedMessages& released) noexcept {
  End& end = ends_.at(&reader);
  const auto from = threads_.find(ManualClock::this_thread());
  if (from == threads_.end() || from->second == end.process)
    return next_.deliver(reader, message, arrival, released);
  const Nanoseconds delay =
      draws_ ? random_.between(end.delay.least, end.delay.longest) : end.delay.longest;
  TimePoint& last = end.last[from->second];
  last = std::max(last, later(clock_.now(), delay));
  Message copy{&reader, &copy_of(message, reader), arrival, instances_of(message.envelope)};
  released.release(message);
  if (has_ended_ || last <= clock_.now()) return arrive(copy, released);
  under_way_.emplace(last, std::move(copy));
  clock_.end_by(last);
}

// The message arrives now; its sending time stays.
void Wire::arrive(Message& message, ReleasedMessages& released) {
  const Arrival arrival{next_sequence(), message.arrival.ready_time};
  message.block->envelope = received(message.instances, arrival);
  next_.deliver(*message.reader, *message.block, arrival, released);
}

TimePoint Wire::next() const noexcept {
  return under_way_.empty() ? kNever : under_way_.begin()->first;
}

void Wire::arrive() {
  ReleasedMessages released;
  const ReadSection section;
  while (next() <= clock_.now()) {
    const auto first = under_way_.extract(under_way_.begin());
    arrive(first.mapped(), released);
  }
}

void Wire::end() {
  has_ended_ = true;
  ReleasedMessages released;
  for (const auto& [time, message] : under_way_) released.release(*message.block);
  under_way_.clear();
}

}  // namespace takt
