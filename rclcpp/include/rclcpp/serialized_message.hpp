// An encoded message.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SERIALIZED_MESSAGE_HPP_
#define RCLCPP__SERIALIZED_MESSAGE_HPP_

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "rclcpp/detail/refused.hpp"
#include "rclcpp/macros.hpp"

/// rcl's view of a serialized message. The SerializedMessage owns the bytes.
struct rcl_serialized_message_t {
  std::uint8_t* buffer = nullptr;
  std::size_t buffer_length = 0;
  std::size_t buffer_capacity = 0;
};
using rmw_serialized_message_t = rcl_serialized_message_t;

namespace rclcpp {

/// A message in CDR, with the encapsulation header of four bytes.
/// Thread safety: a value. Real-time: as std::vector.
class SerializedMessage {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(SerializedMessage)
  explicit SerializedMessage(std::size_t capacity = 0) { reserve(capacity); }
  explicit SerializedMessage(std::span<const std::byte> bytes) {
    reserve(bytes.size());
    if (!bytes.empty()) std::memcpy(handle_.buffer, bytes.data(), bytes.size());
    handle_.buffer_length = bytes.size();
  }
  SerializedMessage(const SerializedMessage& other) : SerializedMessage(other.bytes()) {}
  SerializedMessage(SerializedMessage&& other) noexcept { swap(other); }
  SerializedMessage& operator=(SerializedMessage other) noexcept {
    swap(other);
    return *this;
  }

  rcl_serialized_message_t& get_rcl_serialized_message() { return handle_; }
  const rcl_serialized_message_t& get_rcl_serialized_message() const { return handle_; }
  std::size_t size() const { return handle_.buffer_length; }
  std::size_t capacity() const { return handle_.buffer_capacity; }
  void reserve(std::size_t capacity) {
    if (capacity <= memory_.size()) return;
    memory_.resize(capacity);
    handle_.buffer = memory_.data();
    handle_.buffer_capacity = capacity;
  }
  RCLCPP_REFUSED_(release_rcl_serialized_message, "release of a message's memory")

  std::span<const std::byte> bytes() const {
    return std::as_bytes(std::span(handle_.buffer, handle_.buffer_length));
  }

 private:
  void swap(SerializedMessage& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(handle_, other.handle_);
  }
  std::vector<std::uint8_t> memory_;
  rcl_serialized_message_t handle_;
};

}  // namespace rclcpp

#endif  // RCLCPP__SERIALIZED_MESSAGE_HPP_
