// Publishes what was recorded.
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
/// - `rate` (1.0): how much faster than it was recorded;
/// - `start_delay_ms` (500): until the first message, so that others have found its publishers;
/// - `clock` (false): tells the time of the recording on `/clock`, with each message.
///
/// Messages are sent in the order and at the distances at which they were recorded, byte for byte.
/// The file is read as it is played: when it becomes shorter meanwhile, the callback throws Error.
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
