// A message to be filled in and published.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__LOANED_MESSAGE_HPP_
#define RCLCPP__LOANED_MESSAGE_HPP_

#include <memory>
#include <utility>

#include "takt/entities/publisher.hpp"

namespace rclcpp {

/// Starts with default values, and is published without a copy. Thread safety: a value.
/// Real-time: the message comes from the publisher's pool, where strings and sequences keep their
/// memory. While the whole pool is in transit, messages come from the heap.
template <class M, class Allocator = std::allocator<void>>
class LoanedMessage {
 public:
  explicit LoanedMessage(takt::LoanedMessage<M> place) : place_(std::move(place)) {
    static const M kNew{};
    if (place_) {
      *place_ = kNew;
    } else {
      own_ = std::make_unique<M>();
    }
  }
  LoanedMessage(LoanedMessage&&) noexcept = default;

  bool is_valid() const { return place_ || own_ != nullptr; }
  M& get() const { return place_ ? *place_ : *own_; }
  /// Moves the message to the heap, and hands it over.
  std::unique_ptr<M> release() {
    if (!place_) return std::move(own_);
    const takt::LoanedMessage<M> place = std::move(place_);
    return std::make_unique<M>(std::move(*place));
  }
  // For this library: sends it.
  void publish_with(takt::Publisher<M>& publisher) {
    if (place_) return publisher.publish(std::move(place_));
    publisher.publish(std::move(own_));
  }

 private:
  takt::LoanedMessage<M> place_;
  std::unique_ptr<M> own_;  // when the pool was empty
};

}  // namespace rclcpp

#endif  // RCLCPP__LOANED_MESSAGE_HPP_
