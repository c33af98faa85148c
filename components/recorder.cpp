// SPDX-License-Identifier: Apache-2.0
#include "takt/components/recorder.hpp"

#include <algorithm>
#include <chrono>

#include "takt/base/counted.hpp"
#include "takt/components/named_file.hpp"
#include "takt/components/recorded_qos.hpp"
#include "takt/containers/component.hpp"
#include "takt/messages/described_types.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt {
namespace {

// Period of the search for new topics.
constexpr auto kLookPeriod = std::chrono::milliseconds(200);
// Names of others that are remembered, and lines about them in a second.
// Limit: names of topics that a recorder remembers as refused. At it: a further name is not
// remembered, and is refused again. Seen: the log.
constexpr std::size_t kMostRefused = 1000;
// Limit: lines a second about topics that are not recorded. At it: further lines are left out.
// Seen: the next line counts them.
constexpr std::uint64_t kMostLines = 10;

std::uint64_t since_1970(std::chrono::system_clock::time_point time) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<Nanoseconds>(time.time_since_epoch()).count());
}

ParameterDescriptor at_least(const char* description, std::int64_t least) {
  return {.description = description,
          .read_only = true,
          .integer_range = IntegerRange{least, std::int64_t{1} << 30, 0}};
}

Nanoseconds milliseconds(std::int64_t count) {
  return std::chrono::milliseconds(count);
}

}  // namespace

Recorder::Recorder(const NodeOptions& options, Definitions definitions)
    : Node("recorder", options),
      definitions_(std::move(definitions)),
      place_(named_file(
          options, declare_parameter("file", std::string("recording.mcap"), {.read_only = true}))),
      wanted_([this] {
        std::vector<std::string> topics =
            declare_parameter("topics", std::vector<std::string>{}, {.read_only = true});
        for (std::string& topic : topics) topic = resolve(topic);
        return topics;
      }()),
      depth_(static_cast<std::size_t>(
          declare_parameter("depth", 100, at_least("Messages of a topic that may wait", 1)))),
      flush_period_(
          milliseconds(declare_parameter("flush_ms", 1000, at_least("Until it is written", 1)))),
      discovered_by_(
          later(clock().timeline().now(),
                milliseconds(declare_parameter("discover_ms", 5000,
                                               at_least("How long all topics are found", 0))))),
      writer_(place_,
              static_cast<std::size_t>(
                  declare_parameter("buffer_bytes", std::int64_t{1} << 20,
                                    at_least("A longer message gets its own", 4096))),
              static_cast<std::size_t>(
                  declare_parameter("buffers", 4, at_least("At the same time", 2))),
              declare_parameter("compression", std::string("none"), {.read_only = true})) {
  is_complete_ = options.is_only_constructed;
  looking_ = create_timer("look", kLookPeriod, [this] { look(); });
  flush_ = create_timer("flush", std::chrono::hours(1), [this] { writer_.flush(); });
  flush_->cancel();
  if (participant() != nullptr) types_ = std::make_unique<TypeDescriptionClient>(*this);
  if (const std::string& why = writer_.why_no_ring(); !why.empty()) {
    log(LogLevel::warn, "{}: {}; a thread writes it", place_.path(), why);
  }
  look();
}

Recorder::~Recorder() {
  types_.reset();
  looking_.reset();
  flush_.reset();
  subscriptions_.clear();
  complete();
}

std::string Recorder::complete() {
  if (!std::exchange(is_complete_, true)) {
    for (std::size_t i = 0; i < topics_.size(); ++i) record_waiting(i);
    if (!writer_.close()) report_end();
    log(LogLevel::info, "{}: {} of {}, {} dropped", place_.path(), counted(recorded(), "message"),
        counted(topics_.size(), "topic"), dropped());
    for (const std::string& name : wanted_) {
      const auto is_it = [&](const Topic& topic) { return topic.name == name; };
      if (std::any_of(topics_.begin(), topics_.end(), is_it) || refused_.contains(name)) continue;
      log(LogLevel::warn, "{}: no message of {}, which has had no publisher", place_.path(), name);
    }
  }
  if (dropped() == 0) return "";
  return fmt::format("{} {} not recorded: {}", counted(dropped(), "message"),
                     dropped() == 1 ? "was" : "were",
                     writer_.error() != 0 ? errno_message(writer_.error())
                                          : "the disk was slow, or they had more than 1 GB");
}

// Searches the publishers of this process, and those on the DDS domain.
void Recorder::look() {
  const auto is_wanted = [&](const std::string& topic) {
    const bool is_named = std::find(wanted_.begin(), wanted_.end(), topic) != wanted_.end();
    return topic.starts_with('/') && (wanted_.empty() || is_named) && !refused_.contains(topic) &&
           std::none_of(topics_.begin(), topics_.end(),
                        [&](const Topic& known) { return known.name == topic; });
  };
  for (const Endpoint& publisher : local_topics().publishers) {
    if (!is_wanted(publisher.topic)) continue;
    subscribe(publisher.topic, publisher.type->name, publisher.qos,
              publisher.type->is_serialized ? "" : message_definition(*publisher.type));
  }
  if (participant() != nullptr) {
    for (const GraphEndpoint& publisher : participant()->graph().publishers) {
      if (!is_wanted(publisher.name)) continue;
      const std::string definition = definition_of(publisher.type);
      const auto topic = subscribe(publisher.name, publisher.type, publisher.qos, definition);
      if (topic && definition.empty()) ask_for_definition(*topic, publisher.type);
    }
  }
  const bool has_all = wanted_.empty() ? clock().timeline().now() >= discovered_by_
                                       : topics_.size() == wanted_.size();
  if (has_all) looking_->cancel();
}

// Empty: only the nodes that use it may know it.
std::string Recorder::definition_of(const std::string& type) const {
  if (const MessageType* known = message_types().find(type)) return message_definition(*known);
  return definitions_ ? definitions_(type) : "";
}

// Name, type and QoS are another process's: if they cannot be, only this topic is not recorded.
std::optional<std::size_t> Recorder::subscribe(const std::string& topic, const std::string& type,
                                               const QoS& qos, std::string definition) {
  if (refused_.size() == kMostRefused && !is_topic_name(topic)) return {};
  const std::size_t number = topics_.size();
  QoS own(depth_);
  own.reliability = qos.reliability;
  own.durability = qos.durability;
  try {
    subscriptions_.push_back(create_generic_subscription(
        topic, type, own,
        [this, number](std::span<const std::byte> bytes, const MessageInfo& info) {
          record(number, bytes, info);
        }));
  } catch (const Error& error) {
    if (refused_.size() < kMostRefused) refused_.insert(topic);
    static constinit LogThrottle throttle(kMostLines);
    if (throttle.may_log()) log(LogLevel::warn, "{} is not recorded: {}", topic, error.what());
    return {};
  }
  topics_.push_back({.name = topic});
  return writer_.add({topic, type, std::move(definition), to_recorded_qos(qos)});
}

void Recorder::ask_for_definition(std::size_t topic, const std::string& type) {
  topics_[topic].is_asked_for = true;
  types_->ask(type, [this, topic, type](const TypeDescription* description) {
    define(topic, type, description);
  });
}

// The description is another process's.
void Recorder::define(std::size_t topic, const std::string& type,
                      const TypeDescription* description) {
  if (!topics_[topic].is_asked_for) return;  // there were too many messages to wait for it
  try {
    if (description != nullptr) {
      const DescribedTypes types(*description);
      const MessageType* described = types.find(type);
      if (described != nullptr) writer_.define(topic, message_definition(*described));
    } else if (static constinit LogThrottle throttle(kMostLines); throttle.may_log()) {
      log(LogLevel::info, "{}: no node describes {}; its messages are recorded without",
          topics_[topic].name, type);
    }
  } catch (const Error& error) {
    log(LogLevel::warn, "{}: {} is described wrongly: {}", topics_[topic].name, type, error.what());
  }
  record_waiting(topic);
  flush_later();
}

void Recorder::record_waiting(std::size_t topic) {
  topics_[topic].is_asked_for = false;
  for (const WaitingMessage& message : std::exchange(topics_[topic].waiting, {})) {
    waiting_bytes_ -= message.bytes.size();
    write(topic, message.received_ns, message.published_ns, message.bytes);
  }
}

void Recorder::record(std::size_t topic, std::span<const std::byte> bytes,
                      const MessageInfo& info) {
  const std::uint64_t now = since_1970(std::chrono::system_clock::now());
  std::uint64_t published = now;
  if (info.publish_time != TimePoint{}) {
    published -= static_cast<std::uint64_t>((clock().real().now() - info.publish_time).count());
  }
  // Limit: bytes of the messages of all topics that wait for the definition of their type. At it:
  // those of a topic are recorded without. Seen: nothing.
  constexpr std::size_t kMostWaiting = std::size_t{64} << 20;
  Topic& of = topics_[topic];
  if (of.is_asked_for && of.waiting.size() < depth_ &&
      bytes.size() <= kMostWaiting - std::min(waiting_bytes_, kMostWaiting)) {
    waiting_bytes_ += bytes.size();
    of.waiting.push_back({now, published, {bytes.begin(), bytes.end()}});
    return;
  }
  if (of.is_asked_for) record_waiting(topic);
  write(topic, now, published, bytes);
  flush_later();
}

void Recorder::write(std::size_t topic, std::uint64_t received_ns, std::uint64_t published_ns,
                     std::span<const std::byte> bytes) {
  if (!writer_.write(topic, received_ns, published_ns, bytes)) report_drop(bytes.size());
}

void Recorder::flush_later() {
  if (!writer_.is_pending()) {
    flush_->cancel();
  } else if (flush_->is_canceled()) {
    flush_->release_at(later(flush_->clock().now(), flush_period_));
  }
}

void Recorder::report_drop(std::size_t bytes) {
  ++dropped_;
  if (writer_.error() != 0) return report_end();
  if (std::exchange(has_reported_slow_, true)) return;
  log(LogLevel::warn,
      "{}: a message of {} bytes was dropped: the disk is slow, or it has more than the buffers "
      "may have, 1 GB; increase `buffers` or `buffer_bytes`, or record fewer topics",
      place_.path(), bytes);
}

void Recorder::report_end() {
  if (std::exchange(has_reported_end_, true)) return;
  log(LogLevel::error, "{}: {}; recording stopped", place_.path(), errno_message(writer_.error()));
}

}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Recorder, "writes topics to an MCAP file")
