// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/wire.hpp"

#include <algorithm>
#include <memory>
#include <set>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/containers/running_executors.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/messages/cdr.hpp"

namespace takt {
namespace {

// What the other process gets: the sender has its own back, if it has lent it. A copy would not
// expire, and of a message that is bytes only its publisher knows the type.
MessageBlock& sent(MessageBlock& message, const MessageType& type, ReleasedMessages& released) {
  if (message.can_expire() || type.encode == nullptr) return message;
  auto copy = std::make_unique<ReceivedBlock>();
  copy->from_heap = true;
  if (message.payload() != nullptr) {
    ByteBuffer bytes;
    type.encode(message.payload(), bytes);
    copy->hold_bytes(bytes.bytes());
  } else {
    copy->hold_bytes(message.encoded());
  }
  copy->envelope = message.envelope;
  copy->set_references(1);
  released.release(message);
  return *copy.release();
}

}  // namespace

void Wire::set_up(const SystemDescription& system, std::span<const ModelledProcess> processes,
                  const SystemModel& model, bool do_find_each_other) {
  do_find_each_other_ = do_find_each_other;
  std::vector<std::size_t> process_of;  // by callback, as the model has them
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
  note_what_goes_on(processes);
}

// An envelope comes over as it is, so that chains are measured from end to end. Between processes
// only the time of sending does.
void Wire::note_what_goes_on(std::span<const ModelledProcess> processes) {
  std::set<std::string> notes;
  for (const ModelledProcess& process : processes) {
    for (const ExecutorDescription& executor : process.executors) {
      const std::string scheduler = scheduler_of(executor);
      if (scheduler != "chain_edf" && scheduler != "job_priority") continue;
      notes.insert(fmt::format(
          "`{}` sees when an instance of a chain began in another process; in a run, when its "
          "message was sent",
          scheduler));
    }
    for (const ModelledProcess::Callback& callback : process.callbacks) {
      if (callback.parameters().overrun != OverrunPolicy::abort) continue;
      notes.insert("`overrun: abort` ends an instance of a chain in other processes, too");
    }
  }
  notes_.insert(notes_.end(), notes.begin(), notes.end());
}

void Wire::add_threads(std::size_t process) {
  for (const ManualClock::Use& use : clock_.use()) threads_.try_emplace(use.thread, process);
}

// What no thread of the processes sends comes from outside, when its `arrival` says so.
void Wire::deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
                   ReleasedMessages& released) noexcept {
  End& end = ends_.at(&reader);
  const auto from = threads_.find(ManualClock::this_thread());
  if (from == threads_.end() || from->second == end.process)
    return next_.deliver(reader, message, arrival, released);
  if (!do_find_each_other_) return released.release(message);
  const Nanoseconds delay =
      draws_ ? random_.between(end.delay.least, end.delay.longest) : end.delay.longest;
  TimePoint& last = end.last[from->second];
  last = std::max(last, later(clock_.now(), delay));
  if (has_ended_ || last <= clock_.now()) return next_.deliver(reader, message, arrival, released);
  under_way_.emplace(last,
                     Message{&reader, &sent(message, *reader.endpoint().type, released), arrival});
  clock_.end_by(last);
}

TimePoint Wire::next() const noexcept {
  return under_way_.empty() ? kNever : under_way_.begin()->first;
}

void Wire::arrive() {
  ReleasedMessages released;
  const ReadSection section;
  while (next() <= clock_.now()) {
    Message message = under_way_.extract(under_way_.begin()).mapped();
    message.arrival.sequence = next_sequence();  // it comes now; when it was sent stays
    next_.deliver(*message.reader, *message.block, message.arrival, released);
  }
}

void Wire::end() {
  has_ended_ = true;
  ReleasedMessages released;
  for (const auto& [time, message] : under_way_) released.release(*message.block);
  under_way_.clear();
}

}  // namespace takt
