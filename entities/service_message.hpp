// The messages between services and clients.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SERVICE_MESSAGE_HPP_
#define TAKT_ENTITIES_SERVICE_MESSAGE_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/message_block.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// A type that describes a service: `struct AddTwoInts { struct Request {...}; struct Response
/// {...}; };`, with TAKT_MESSAGE(AddTwoInts::Request, "example_interfaces/srv/AddTwoInts_Request",
/// a, b) and TAKT_MESSAGE(AddTwoInts::Response, "example_interfaces/srv/AddTwoInts_Response", sum).
template <class S>
concept ServiceType = Message<typename S::Request> && Message<typename S::Response>;

/// A request or a response, behind ROS 2's header on the wire: whose call it is, and which of the
/// client's. A service returns both numbers as they came.
template <Message T>
struct ServiceMessage {
  std::uint64_t client = 0;  // the first field, because readers are addressed by it
  std::int64_t sequence = 0;
  T body{};
};

template <Message T>
const MessageType& takt_message_type(const ServiceMessage<T>*) {
  using Type = ServiceMessage<T>;
  static const MessageType& type = detail::make_message_type(
      message_type<T>().name, detail::kLayoutOf<Type>,
      {detail::describe_field<std::uint64_t>("client", offsetof(Type, client)),
       detail::describe_field<std::int64_t>("sequence", offsetof(Type, sequence)),
       detail::describe_field<T>("body", offsetof(Type, body))});
  return type;
}

template <class Visitor, class M>
requires requires(M& message) {
  message.client, message.sequence, message.body;
}
void takt_visit_fields(Visitor& visitor, M& message) {
  visitor(message.client), visitor(message.sequence), visitor(message.body);
}

/// How many requests a service keeps that it has not served: what comes beyond replaces the oldest,
/// and is counted as dropped.
inline constexpr std::size_t kServiceDepth = 200;

/// How many messages of a service are made in advance: as many as can be in transit, but no more
/// than a mebibyte of them, or four. Beyond that, they come from the heap.
template <class T>
constexpr std::size_t service_loans(std::size_t most) {
  return most_in_advance(most, sizeof(T));
}

/// What both ends of a service, or of a client, publish about it: a unique id, and the service's
/// type. Nothing without a participant.
template <ServiceType S>
ServiceIdentity service_identity(const char* kind,
                                 const std::shared_ptr<Participant>& participant) {
  if (participant == nullptr) return {};
  return {new_service_id(kind), &message_type<typename S::Request>(),
          &message_type<typename S::Response>()};
}

/// ROS 2's names: "/add" is "rq/addRequest" and "rr/addReply".
inline std::string request_topic(const std::string& service) {
  return "rq" + service + "Request";
}
inline std::string reply_topic(const std::string& service) {
  return "rr" + service + "Reply";
}

}  // namespace takt

#endif  // TAKT_ENTITIES_SERVICE_MESSAGE_HPP_
