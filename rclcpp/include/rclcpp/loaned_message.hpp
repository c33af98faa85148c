// A message to be filled in and published.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__LOANED_MESSAGE_HPP_
#define RCLCPP__LOANED_MESSAGE_HPP_

#include <memory>
#include <utility>

namespace rclcpp {

/// It comes from the heap, as in rclcpp where the middleware lends none, and is not copied when it
/// is published.
/// Thread safety: a value. Real-time: it allocates.
template <class M, class Allocator = std::allocator<void>>
class LoanedMessage {
 public:
  LoanedMessage() : message_(std::make_unique<M>()) {}
  LoanedMessage(LoanedMessage&&) noexcept = default;

  bool is_valid() const { return message_ != nullptr; }
  M& get() const { return *message_; }
  std::unique_ptr<M> release() { return std::move(message_); }

 private:
  std::unique_ptr<M> message_;
};

}  // namespace rclcpp

#endif  // RCLCPP__LOANED_MESSAGE_HPP_
