// The component that plays recorded topics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_PLAYER_HPP_
#define TAKT_COMPONENTS_PLAYER_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/component.hpp"
#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/nodes/node.hpp"
#include "takt/recording/mcap.hpp"

namespace TAKT_INTERNAL takt {

/// The component takt::Player. Its parameters:
/// - `file`: an MCAP file, by takt::Recorder or ros2 bag. If a request loads the player: one in the
///   folder that `load: {recordings: DIR}` of the container names;
/// - `topics`: names; if empty, all topics of the file;
/// - `rate` (1.0): playback speed; 2.0 plays twice as fast as recorded;
/// - `start_offset_ms` (0): the time in the recording at which it begins;
/// - `loop` (false): begins again at the end;
/// - `start_delay_ms` (500): delay of the first message, while subscribers discover the publishers;
/// - `clock` (false): publishes the recorded time on `/clock` with each message.
///
/// The messages are published byte for byte, in the order and at the intervals of the recording,
/// with the recorded reliability and durability.
/// The file is read during playback: if it is truncated meanwhile, the callback throws Error.
/// Thread safety: as Node. Real-time: no.
class Player : public Node, public SetsReleases {
 public:
  explicit Player(const NodeOptions& options);
  ~Player() override;

  std::uint64_t played() const noexcept { return played_; }
  /// Whether all messages were played; never with `loop`. From any thread.
  bool has_ended() const noexcept { return has_ended_.load(); }

 private:
  void publish_topics(const std::vector<std::string>& wanted);
  Nanoseconds since_first(const RecordedMessage& message) const;
  void play();
  void publish(const RecordedMessage& message);

  McapReader reader_;
  const double rate_;
  const bool loops_;
  std::vector<std::shared_ptr<GenericPublisher>> publishers_;  // nullptr: not to be played
  std::shared_ptr<Publisher<rosgraph_msgs::msg::Clock>> clock_publisher_;
  std::size_t first_ = 0, next_ = 0;  // in the recording's messages
  std::uint64_t played_ = 0;
  std::atomic<bool> has_ended_{false};
  TimePoint begin_{};
  std::shared_ptr<Timer> timer_;
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_PLAYER_HPP_
