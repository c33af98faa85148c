// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/intra_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/read_section.hpp"
#include "takt/base/sequence.hpp"

namespace takt {

/// Who is on which topic. Set-up and tear-down only; `write` never comes here.
class Topics {
 public:
  static Topics& instance() {
    static Topics topics;
    return topics;
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
    const std::lock_guard lock(mutex_);
    Topic& topic = find(reader.endpoint());
    topic.readers.push_back(&reader);
    for (IntraProcessWriter* writer : topic.writers) {
      IntraProcessWriter::Table table = *writer->table_.load();
      link(table, *writer, reader);
      replace(*writer, std::move(table));
    }
  }

  void remove(IntraProcessWriter& writer) noexcept {
    const std::lock_guard lock(mutex_);
    std::erase(topics_.find(writer.endpoint().topic)->second.writers, &writer);
    replace(writer, {});
    forget_if_empty(writer.endpoint().topic);
  }

  void remove(IntraProcessReader& reader) noexcept {
    const std::lock_guard lock(mutex_);
    Topic& topic = topics_.find(reader.endpoint().topic)->second;
    std::erase(topic.readers, &reader);
    for (IntraProcessWriter* writer : topic.writers) {
      IntraProcessWriter::Table table = *writer->table_.load();
      std::erase(table, &reader);
      replace(*writer, std::move(table));
    }
    forget_if_empty(reader.endpoint().topic);
  }

 private:
  struct Topic {
    const MessageType* type;
    std::vector<IntraProcessWriter*> writers;
    std::vector<IntraProcessReader*> readers;
  };

  Topic& find(const Endpoint& endpoint) {
    Topic& topic = topics_.try_emplace(endpoint.topic, Topic{endpoint.type, {}, {}}).first->second;
    if (topic.type->name != endpoint.type->name ||
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

  static void link(IntraProcessWriter::Table& table, const IntraProcessWriter& writer,
                   IntraProcessReader& reader) {
    if (writer.endpoint().qos.serves(reader.endpoint().qos)) {
      table.push_back(&reader);
    } else {
      log(LogLevel::warn, "{}: a best-effort publisher does not serve a reliable subscription",
          writer.endpoint().topic);
    }
  }

  static void replace(IntraProcessWriter& writer, IntraProcessWriter::Table table) {
    const std::unique_ptr<const IntraProcessWriter::Table> old(
        writer.table_.exchange(new IntraProcessWriter::Table(std::move(table))));
    wait_for_readers();
  }

  PiMutex mutex_;
  std::map<std::string, Topic> topics_;
};

IntraProcessReader::IntraProcessReader(Endpoint endpoint)
    : endpoint_((endpoint.qos.check(), std::move(endpoint))), ring_(endpoint_.qos.depth) {}

IntraProcessReader::~IntraProcessReader() {
  bool more = true;
  while (more) {
    if (MessageBlock* message = take(more)) message->release();
  }
}

void IntraProcessReader::join() {
  Topics::instance().add(*this);
  joined_ = true;
}

void IntraProcessReader::leave() noexcept {
  if (std::exchange(joined_, false)) Topics::instance().remove(*this);
}

IntraProcessWriter::IntraProcessWriter(Endpoint endpoint, Clock& clock)
    : endpoint_((endpoint.qos.check(), std::move(endpoint))), clock_(clock), table_(new Table) {
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
}

void IntraProcessWriter::write(MessageBlock& message) noexcept {
  const ReadSection section;
  const Table& table = *table_.load();
  Arrival arrival{next_sequence(), {}};
  for (const IntraProcessReader* reader : table) {
    if (reader->wants_time()) {
      arrival.ready_time = clock_.now();
      break;
    }
  }
  message.envelope.sequence = arrival.sequence;
  message.envelope.publish_time = arrival.ready_time;
  message.set_references(table.empty() ? 1 : static_cast<std::uint32_t>(table.size()));
  if (table.empty()) message.release();
  // Each reader owns one reference; after the last delivery the message may be gone.
  for (IntraProcessReader* reader : table) reader->deliver(message, arrival);
}

std::size_t IntraProcessWriter::reader_count() const noexcept {
  const ReadSection section;
  return table_.load()->size();
}

}  // namespace takt
