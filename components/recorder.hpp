// The component that records topics to a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_RECORDER_HPP_
#define TAKT_COMPONENTS_RECORDER_HPP_

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/component.hpp"
#include "takt/nodes/node.hpp"
#include "takt/recording/mcap.hpp"
#include "takt/ros2/type_description_client.hpp"

namespace TAKT_INTERNAL takt {

/// The component takt::Recorder. Its parameters:
/// - `file`: an MCAP file, which is overwritten. If a request loads the recorder: a new file in the
///   folder that `load: {recordings: DIR}` of the container names;
/// - `topics`: names; if empty, all topics discovered in the first `discover_ms`;
/// - `depth` (100): queue depth of each subscription. When a queue is full, the oldest message is
///   dropped and counted in the subscription's statistics;
/// - `buffers` (4) of `buffer_bytes` (1 MiB): a message must fit into one buffer. While all buffers
///   are being written to disk, messages are dropped and counted;
/// - `flush_ms` (1000): a partly filled buffer is written after this time;
/// - `compression` (none): `lz4` or `zstd`; the recorder's thread compresses buffer by buffer.
///
/// The file contains the definitions of the types. Nodes of other processes are asked for those of
/// their types that no library of this process registers; meanwhile messages wait, at most `depth`
/// of a topic.
///
/// Publishers in the same process pass messages by pointer; the recorder's thread encodes them. So
/// recording costs a publisher no more than another subscription does, and blocks no callback if
/// the recorder has its own executor and thread. Messages from DDS are written without decoding.
/// When the disk is full, the recorder reports it once and stops; the file stays valid. If any
/// message was not recorded, `takt run` exits with 1. Without io_uring, a thread writes the file,
/// and the log reports this.
///
/// A topic of another process that cannot be recorded, such as one whose name ROS 2 does not
/// permit, is reported and left out.
///
/// Thread safety: as Node. Real-time: no.
class Recorder : public Node, public Completing {
 public:
  /// The definition of a type that only other processes publish, and that is not registered here;
  /// empty: their nodes are asked.
  using Definitions = std::function<std::string(const std::string& type)>;

  explicit Recorder(const NodeOptions& options, Definitions definitions = {});
  ~Recorder() override;

  std::uint64_t recorded() const noexcept { return writer_.messages(); }
  /// Messages that were not recorded: the disk was slow or full, or they exceeded a buffer.
  std::uint64_t dropped() const noexcept { return dropped_ + writer_.lost(); }
  bool has_ended() const noexcept { return has_reported_end_; }
  std::size_t topic_count() const noexcept { return topics_.size(); }
  /// Writes the remaining buffers and the end of the file.
  std::string complete() override;

 private:
  struct WaitingMessage {
    std::uint64_t received_ns, published_ns;
    std::vector<std::byte> bytes;
  };
  struct Topic {
    std::string name;
    bool is_asked_for = false;  // the definition of its type
    std::vector<WaitingMessage> waiting;
  };

  void look();
  std::string definition_of(const std::string& type) const;
  std::optional<std::size_t> subscribe(const std::string& topic, const std::string& type,
                                       const QoS& qos, std::string definition);
  void ask_for_definition(std::size_t topic, const std::string& type);
  void define(std::size_t topic, const std::string& type, const TypeDescription* description);
  void record_waiting(std::size_t topic);
  void record(std::size_t topic, std::span<const std::byte> bytes, const MessageInfo& info);
  void write(std::size_t topic, std::uint64_t received_ns, std::uint64_t published_ns,
             std::span<const std::byte> bytes);
  void flush_later();
  void report_drop(std::size_t bytes);
  void report_end();

  const Definitions definitions_;
  const FilePlace place_;
  const std::vector<std::string> wanted_;
  const std::size_t depth_;
  const Nanoseconds flush_period_;
  const TimePoint discovered_by_;
  McapWriter writer_;
  std::size_t waiting_bytes_ = 0;  // of all topics
  std::uint64_t dropped_ = 0;
  bool has_reported_slow_ = false, has_reported_end_ = false, is_complete_ = false;
  std::vector<Topic> topics_;
  std::set<std::string, std::less<>> refused_;  // that no subscription can have
  std::vector<std::shared_ptr<SubscriptionBase>> subscriptions_;
  std::shared_ptr<Timer> looking_, flush_;
  std::unique_ptr<TypeDescriptionClient> types_;  // of other processes
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_RECORDER_HPP_
