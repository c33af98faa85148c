// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/intra_process.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <mutex>
#include <span>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/probes.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt {

/// The readers and writers of each topic. Set-up and tear-down only; `write` never comes here.
class Topics {
 public:
  static Topics& instance() {
    static detail::NeverDestroyed<Topics> topics;
    return *topics;
  }

  void add(IntraProcessWriter& writer) {
    const std::lock_guard lock(mutex_);
    Topic& topic = find(writer.endpoint());
    IntraProcessWriter::Table table;
    for (IntraProcessReader* reader : topic.readers) link(table, writer, *reader);
    topic.writers.push_back(&writer);
    replace(writer, std::move(table));
  }

  void add(IntraProcessReader& reader) {
    ReleasedMessages released;
    const std::lock_guard lock(mutex_);
    Topic& topic = find(reader.endpoint());
    topic.readers.push_back(&reader);
    for (IntraProcessWriter* writer : topic.writers) {
      IntraProcessWriter::Table table = *writer->table_.load();
      if (!link(table, *writer, reader)) continue;
      const bool comes_late = writer->history_ != nullptr &&
                              reader.endpoint().qos.durability == Durability::transient_local;
      if (comes_late) {
        hand_over(*writer, std::move(table), reader, released);
      } else {
        replace(*writer, std::move(table));
      }
    }
  }

  void remove(IntraProcessWriter& writer) noexcept {
    const std::lock_guard lock(mutex_);
    std::erase(topics_.find(writer.endpoint().topic)->second.writers, &writer);
    for (IntraProcessReader* reader : *writer.table_.load()) match(writer, *reader, -1);
    replace(writer, {});
    forget_if_empty(writer.endpoint().topic);
  }

  void remove(IntraProcessReader& reader) noexcept {
    const std::lock_guard lock(mutex_);
    Topic& topic = topics_.find(reader.endpoint().topic)->second;
    std::erase(topic.readers, &reader);
    for (IntraProcessWriter* writer : topic.writers) {
      IntraProcessWriter::Table table = *writer->table_.load();
      if (std::erase(table, &reader) == 0) continue;
      match(*writer, reader, -1);
      replace(*writer, std::move(table));
    }
    forget_if_empty(reader.endpoint().topic);
  }

  std::vector<RefusedLoans> refused_loans() {
    const std::lock_guard lock(mutex_);
    std::vector<RefusedLoans> result;
    for (const auto& [name, topic] : topics_) {
      for (const auto* writer : topic.writers) {
        if (const std::uint64_t count = writer->refused_loans(); count != 0) {
          result.push_back({name, writer->endpoint().node, count});
        }
      }
    }
    return result;
  }

  LocalTopics ends() {
    const std::lock_guard lock(mutex_);
    LocalTopics result;
    for (const auto& [name, topic] : topics_) {
      for (const auto* writer : topic.writers) result.publishers.push_back(writer->endpoint());
      for (const auto* reader : topic.readers) result.subscriptions.push_back(reader->endpoint());
    }
    return result;
  }

 private:
  struct Topic {
    const MessageType* type;
    std::vector<IntraProcessWriter*> writers;
    std::vector<IntraProcessReader*> readers;
  };

  Topic& find(const Endpoint& endpoint) {
    Topic& topic = topics_.try_emplace(endpoint.topic, Topic{endpoint.type, {}, {}}).first->second;
    const bool is_known = !topic.type->is_serialized && !endpoint.type->is_serialized;
    if (topic.type->name == endpoint.type->name && !is_known) {
      if (topic.type->is_serialized) topic.type = endpoint.type;
    } else if (topic.type->name != endpoint.type->name ||
               topic.type->layout_hash != endpoint.type->layout_hash) {
      throw Error(
          fmt::format("topic '{}' carries {} (layout {:x}), not {} (layout {:x})", endpoint.topic,
                      topic.type->name, topic.type->layout_hash, endpoint.type->name,
                      endpoint.type->layout_hash),
          "give the topic another name, or build both sides from one definition of the type");
    }
    return topic;
  }

  void forget_if_empty(const std::string& name) noexcept {
    const auto topic = topics_.find(name);
    if (topic->second.writers.empty() && topic->second.readers.empty()) topics_.erase(topic);
  }

  static bool link(IntraProcessWriter::Table& table, const IntraProcessWriter& writer,
                   IntraProcessReader& reader) {
    const std::string_view policy = writer.endpoint().qos.refuses(reader.endpoint().qos);
    if (policy.empty()) {
      if (!writer.endpoint().type->is_serialized) {
        reader.set_payload_type(*writer.endpoint().type);
      }
      table.push_back(&reader);
      match(writer, reader, 1);
    } else {
      writer.events_->incompatible(policy);
      reader.events()->incompatible(policy);
      log(LogLevel::warn,
          "topic '{}': the publisher of '{}' offers less than the subscription of '{}' asks for: "
          "{}; no message passes",
          writer.endpoint().topic, writer.endpoint().node, reader.endpoint().node, policy);
    }
    return policy.empty();
  }

  static void match(const IntraProcessWriter& writer, const IntraProcessReader& reader,
                    int change) {
    writer.events_->matched(change);
    reader.events()->matched(change);
    if (writer.lease_ == nullptr) {
      reader.events()->liveliness_changed(change, 0);
    } else if (change > 0) {
      reader.events()->follow(writer.lease_);
    } else {
      reader.events()->leave(*writer.lease_);
    }
  }

  static void replace(IntraProcessWriter& writer, IntraProcessWriter::Table table) {
    const std::unique_ptr<const IntraProcessWriter::Table> old(
        writer.table_.exchange(new IntraProcessWriter::Table(std::move(table))));
    wait_for_readers();
  }

  /// As replace, but first gives `late` the messages that the writer keeps for late joiners.
  static void hand_over(IntraProcessWriter& writer, IntraProcessWriter::Table table,
                        IntraProcessReader& late, ReleasedMessages& released) {
    std::unique_ptr<const IntraProcessWriter::Table> old(
        new IntraProcessWriter::Table(std::move(table)));
    {
      const std::lock_guard lock(writer.history_->mutex);
      hand_over(*writer.history_, late, released);
      old.reset(writer.table_.exchange(old.release()));
    }
    wait_for_readers();
  }

  // Only as many as fit, so that the reader drops none of these.
  static void hand_over(const IntraProcessWriter::History& history, IntraProcessReader& late,
                        ReleasedMessages& released) {
    const ReadSection section;
    const std::size_t depth = history.messages.size();  // or fewer, with the oldest first
    const std::size_t count = std::min(depth, late.endpoint().qos.depth);
    for (std::size_t i = depth - count; i < depth; ++i) {
      MessageBlock* message = history.messages[(history.next + i) % depth];
      message->retain();
      late.deliver(*message, {message->envelope.sequence, message->envelope.ready_time}, released);
    }
  }

  RankedMutex<LockRank::topics> mutex_;
  std::map<std::string, Topic> topics_;
};

LocalTopics local_topics() {
  return Topics::instance().ends();
}

std::vector<RefusedLoans> refused_loans() {
  return Topics::instance().refused_loans();
}

IntraProcessReader::IntraProcessReader(Endpoint endpoint)
    : endpoint_((endpoint.qos.check(), std::move(endpoint))),
      ring_(endpoint_.qos.depth),
      has_deadline_(endpoint_.qos.deadline_period != Nanoseconds::zero()) {
}

IntraProcessReader::~IntraProcessReader() {
  bool more = true;
  while (more) {
    if (MessageBlock* message = take(more)) message->release();
  }
}

void IntraProcessReader::select(MessageBlock& message, const Arrival& arrival,
                                ReleasedMessages& released) noexcept {
  const bool is_for_us = address_ == 0 || message.address().value_or(address_) ==
                                              address_;  // the decoder refuses others
  if (!is_for_us) return released.release(message);
  if (filter_ != nullptr) return filter_->deliver(*this, message, arrival, released);
  deliver_now(message, arrival, released);
}

void IntraProcessReader::join() {
  Topics::instance().add(*this);
  joined_ = true;
}

void IntraProcessReader::leave() noexcept {
  if (std::exchange(joined_, false)) Topics::instance().remove(*this);
}

MessageBlock* IntraProcessReader::take(bool& more, ReleasedMessages& released) noexcept {
  MessageBlock* message = pop(more, released);
  return message != nullptr && message->can_expire() ? skip_expired(message, more, released)
                                                     : message;
}

MessageBlock* IntraProcessReader::pop(bool& more, ReleasedMessages& released) noexcept {
  const auto discard = [&](MessageBlock* old) {
    if (drop(*old)) released.add(*old);
  };
  return ring_.pop(discard, more);
}

MessageBlock* IntraProcessReader::skip_expired(MessageBlock* message, bool& more,
                                               ReleasedMessages& released) noexcept {
  while (message != nullptr && message->is_expired()) {
    if (drop(*message)) released.add(*message);
    message = pop(more, released);
  }
  return message;
}

// Not inline: otherwise callers that drop nothing would lose registers to it. True: nobody holds
// the message any more.
bool IntraProcessReader::drop(MessageBlock& message) noexcept {
  dropped_.fetch_add(1, std::memory_order_relaxed);  // a statistic, ordered by nothing
  const bool is_last = message.is_last_release();
  events_->lost(1);
  return is_last;
}

void IntraProcessReader::drop_now(MessageBlock& message) noexcept {
  ReleasedMessages released;
  if (drop(message)) released.add(message);
}

namespace {
std::shared_ptr<LivelinessLease> lease_of(const QoS& qos, const Clock& clock) {
  const bool is_manual = qos.liveliness_kind == Liveliness::manual_by_topic;
  if (!is_manual || QoS::is_for_ever(qos.lease_duration)) return nullptr;
  return std::make_shared<LivelinessLease>(qos.lease_duration, clock.now());
}
}  // namespace

IntraProcessWriter::IntraProcessWriter(Endpoint endpoint, Clock& clock)
    : endpoint_((endpoint.qos.check(), std::move(endpoint))),
      clock_(clock),
      history_(endpoint_.qos.durability == Durability::transient_local ? std::make_unique<History>()
                                                                       : nullptr),
      lease_(lease_of(endpoint_.qos, clock)),
      has_policies_(history_ != nullptr || lease_ != nullptr ||
                    endpoint_.qos.lifespan_duration != Nanoseconds::zero() ||
                    endpoint_.qos.deadline_period != Nanoseconds::zero()),
      table_(new Table) {
  if (history_ != nullptr) history_->messages.reserve(endpoint_.qos.depth);
  try {
    Topics::instance().add(*this);
  } catch (...) {
    delete table_.load();
    throw;
  }
}

IntraProcessWriter::~IntraProcessWriter() {
  Topics::instance().remove(*this);
  delete table_.load();
  if (history_ == nullptr) return;
  for (MessageBlock* message : history_->messages) message->release();
}

void IntraProcessWriter::write(MessageBlock& message, TimePoint published,
                               std::uint32_t kept) noexcept {
  if (has_policies_) [[unlikely]] {
    ReleasedMessages released;
    return send_by_policies(message, published, kept, released);
  }
  ReleasedMessages released;
  send(message, published, kept, released);
}

void IntraProcessWriter::write(MessageBlock& message, TimePoint published, std::uint32_t kept,
                               ReleasedMessages& released) noexcept {
  if (has_policies_) [[unlikely]]
    return send_by_policies(message, published, kept, released);
  send(message, published, kept, released);
}

void IntraProcessWriter::send_by_policies(MessageBlock& message, TimePoint published,
                                          std::uint32_t kept, ReleasedMessages& released) noexcept {
  const TimePoint now = published != TimePoint{} ? published : clock_.now();
  events_->set_last_message(now);
  assert_liveliness();
  if (endpoint_.qos.lifespan_duration != Nanoseconds::zero()) {
    message.expire_at(later(now, endpoint_.qos.lifespan_duration), clock_);
  }
  if (history_ == nullptr) return send(message, now, kept, released);
  const std::lock_guard lock(history_->mutex);
  message.envelope.sequence = next_sequence();  // there may be no reader yet
  message.envelope.ready_time = now;
  if (auto& kept_before = history_->messages; kept_before.size() < endpoint_.qos.depth) {
    kept_before.push_back(&message);  // the memory is reserved
  } else {
    released.release(*std::exchange(kept_before[history_->next], &message));
    history_->next = (history_->next + 1) % kept_before.size();
  }
  send(message, now, kept + 1, released);
}

[[gnu::always_inline]] inline void IntraProcessWriter::send(MessageBlock& message,
                                                            TimePoint published, std::uint32_t kept,
                                                            ReleasedMessages& released) noexcept {
  TAKT_PROBE(publish, endpoint_.topic.c_str(), message.payload());
  const ReadSection section;
  const std::span readers(*table_.load());
  if (readers.empty()) {
    message.set_references(kept + 1);
    return released.release(message);
  }
  Arrival arrival{next_sequence(), {}, message.envelope.root_release};
  bool wants_time = false;
  for (const IntraProcessReader* reader : readers) {
    if (reader->wants_time()) {
      arrival.ready_time = published != TimePoint{} ? published : clock_.now();
      wants_time = true;
      break;
    }
  }
  if (wants_time_.load(std::memory_order_relaxed) != wants_time) [[unlikely]]
    wants_time_.store(wants_time, std::memory_order_relaxed);
  message.envelope.sequence = arrival.sequence;
  message.envelope.ready_time = arrival.ready_time;
  message.set_references(kept + static_cast<std::uint32_t>(readers.size()));
  // Each reader owns one reference: after the last delivery, the message may be freed.
  for (IntraProcessReader* reader : readers) reader->deliver(message, arrival, released);
}

// The address is a unique index while the message is in the ring.
void IntraProcessWriter::trace_enqueue(const Tracepoints& points,
                                       const void* message) const noexcept {
  const ReadSection section;
  for (const IntraProcessReader* reader : *table_.load()) {
    const std::size_t depth = reader->endpoint().qos.depth, queued = reader->queued();
    points.rclcpp_ring_buffer_enqueue(reader, reinterpret_cast<std::uintptr_t>(message),
                                      std::min(queued + 1, depth), queued < depth ? 0 : 1);
  }
}

void IntraProcessWriter::assert_liveliness() noexcept {
  if (lease_ == nullptr || !lease_->is_alive(clock_.now())) return;
  const ReadSection section;
  for (IntraProcessReader* reader : *table_.load()) reader->events()->hear_of_lease();
}

std::size_t IntraProcessWriter::reader_count() const noexcept {
  const ReadSection section;
  return table_.load()->size();
}

}  // namespace takt
