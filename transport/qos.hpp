// What a publisher offers and a subscription asks for; the names are rclcpp's.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_QOS_HPP_
#define TAKT_TRANSPORT_QOS_HPP_

#include <cstddef>

namespace takt {

enum class Reliability { reliable, best_effort };

/// Keep-last history of `depth` messages. Durability is volatile.
struct QoS {
  // Not explicit: rclcpp's users write `create_publisher<T>("topic", 10)`.
  QoS(std::size_t keep_last = 10) : depth(keep_last) {}  // NOLINT(google-explicit-constructor)

  QoS& reliable() noexcept { return reliability = Reliability::reliable, *this; }
  QoS& best_effort() noexcept { return reliability = Reliability::best_effort, *this; }

  /// Throws Error when the depth is 0 or beyond what a subscription's ring can hold.
  void check() const;
  /// Whether a publisher that offers this serves a subscription that asks for `requested`.
  bool serves(const QoS& requested) const noexcept {
    return reliability == Reliability::reliable || requested.reliability == Reliability::best_effort;
  }

  std::size_t depth;
  Reliability reliability = Reliability::reliable;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_QOS_HPP_
