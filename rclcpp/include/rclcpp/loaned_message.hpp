// A message to be filled in and published.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__LOANED_MESSAGE_HPP_
#define RCLCPP__LOANED_MESSAGE_HPP_

#include <memory>
#include <utility>

#include "takt/entities/publisher.hpp"

namespace rclcpp {

/// It is as new, and is not copied when it is published. Thread safety: a value.
/// Real-time: it lies where its publisher would copy a message to, and keeps the memory of strings
/// and sequences there; it comes from the heap when all of these are in transit.
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
  /// Moved to the heap.
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
  std::unique_ptr<M> own_;  // if there was no place
};

}  // namespace rclcpp

#endif  // RCLCPP__LOANED_MESSAGE_HPP_
