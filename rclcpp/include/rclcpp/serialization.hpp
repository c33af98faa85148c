// Encodes and decodes messages.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SERIALIZATION_HPP_
#define RCLCPP__SERIALIZATION_HPP_

#include <stdexcept>

#include "takt/messages/message_type.hpp"

#include "rclcpp/serialized_message.hpp"

namespace rclcpp {

class SerializationBase {
 public:
  explicit SerializationBase(const takt::MessageType& type) : type_(type) {}
  virtual ~SerializationBase() = default;

  void serialize_message(const void* message, SerializedMessage* serialized) const {
    takt::ByteBuffer bytes;
    type_.encode(message, bytes);
    *serialized = SerializedMessage(bytes.bytes());
  }
  void deserialize_message(const SerializedMessage* serialized, void* message) const {
    if (!type_.decode(serialized->bytes(), message)) {
      throw std::runtime_error("the bytes are no message of type " + type_.name);
    }
  }

 private:
  const takt::MessageType& type_;
};
/// Thread safety: immutable. Real-time: encoding allocates.
template <takt::Message M>
class Serialization : public SerializationBase {
 public:
  Serialization() : SerializationBase(takt::message_type<M>()) {}
};

}  // namespace rclcpp

#endif  // RCLCPP__SERIALIZATION_HPP_
