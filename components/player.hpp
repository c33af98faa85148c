// The component that plays recorded topics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_PLAYER_HPP_
#define TAKT_COMPONENTS_PLAYER_HPP_

#include <memory>
#include <vector>

#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/nodes/node.hpp"
#include "takt/recording/mcap.hpp"

namespace takt {

/// The component takt::Player. Its parameters:
/// - `file`: an MCAP file, by takt::Recorder or ros2 bag, uncompressed;
/// - `rate` (1.0): playback speed; 2.0 plays twice as fast as recorded;
/// - `start_delay_ms` (500): delay of the first message, while subscribers discover the publishers;
/// - `clock` (false): publishes the recorded time on `/clock` with each message.
///
/// The messages are published byte for byte, in the order and at the intervals of the recording.
/// The file is read during playback: if it is truncated meanwhile, the callback throws Error.
/// Thread safety: as Node. Real-time: no.
class Player : public Node {
 public:
  explicit Player(const NodeOptions& options);
  ~Player() override;

 private:
  void play();

  McapReader reader_;
  const double rate_;
  std::vector<std::shared_ptr<GenericPublisher>> publishers_;
  std::shared_ptr<Publisher<rosgraph_msgs::msg::Clock>> clock_publisher_;
  std::size_t next_ = 0;
  TimePoint begin_{};
  std::shared_ptr<Timer> timer_;
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_PLAYER_HPP_
