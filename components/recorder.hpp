// Writes topics to a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_RECORDER_HPP_
#define TAKT_COMPONENTS_RECORDER_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/containers/component.hpp"
#include "takt/nodes/node.hpp"
#include "takt/recording/mcap.hpp"

namespace takt {

/// The component takt::Recorder. Its parameters:
/// - `file`: an MCAP file, which is overwritten;
/// - `topics`: names; without any, all that come up in the first `discover_ms`;
/// - `depth` (100): how many messages of a topic wait while the recorder is busy; older ones are
///   dropped, and counted as any subscription's;
/// - `buffers` (4) of `buffer_bytes` (1 MiB): a message must fit into one. When all are on their
///   way to the disk, messages are dropped and counted;
/// - `flush_ms` (1000): after so long a buffer is written though it is not full.
///
/// What is published in its process comes by pointer, and is encoded on the recorder's thread: a
/// publisher does no more for it than for any reader, and a callback waits for nothing. Give it an
/// executor and a thread of its own. What comes by DDS is written as it has come. A disk that fills
/// up ends the recording: that is reported once, and the file is complete up to there. When
/// messages were not recorded, `takt run` exits with 1. Where the kernel grants no io_uring, a
/// thread writes; a line of the log says so.
///
/// Thread safety: as Node. Real-time: no.
class Recorder : public Node, public Completing {
 public:
  explicit Recorder(const NodeOptions& options);
  ~Recorder() override;

  std::uint64_t recorded() const noexcept { return writer_.messages(); }
  /// Because the disk was slow or full, or they were larger than a buffer.
  std::uint64_t dropped() const noexcept { return dropped_ + writer_.lost(); }
  bool has_ended() const noexcept { return has_reported_end_; }
  /// Writes the file to its end.
  std::string complete() override;

 private:
  struct Topic;
  void look();
  void subscribe(const std::string& topic, const std::string& type, const QoS& qos,
                 std::string definition);
  void record(std::size_t topic, std::span<const std::byte> bytes, const MessageInfo& info);
  void report_drop(std::size_t bytes);
  void report_end();

  const std::string file_;
  const std::vector<std::string> wanted_;
  const std::size_t depth_;
  const Nanoseconds flush_period_;
  const TimePoint discovered_by_;
  McapWriter writer_;
  std::uint64_t dropped_ = 0;
  bool has_reported_slow_ = false, has_reported_end_ = false, is_complete_ = false;
  std::vector<std::string> topics_;
  std::vector<std::shared_ptr<SubscriptionBase>> subscriptions_;
  std::shared_ptr<Timer> looking_, flush_;
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_RECORDER_HPP_
