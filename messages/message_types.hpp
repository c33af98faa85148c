// The message types that a process knows by name, and the macro that registers them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_MESSAGE_TYPES_HPP_
#define TAKT_MESSAGES_MESSAGE_TYPES_HPP_

#include <array>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {

struct Registration;  // of a library

/// The types that the program and its loaded libraries registered, and all types in them. Not those
/// of publishers and subscriptions, which need no registration. Two registrations of a name must
/// have the same layout hash. Nothing is described before the first question, so that programs
/// which ask nothing do not pay for it.
/// Thread safety: every method may be called from any thread.
/// Real-time: no; it allocates.
class MessageTypes {
 public:
  using Describe = const MessageType& (*)();

  /// The type with this name, "std_msgs/msg/String"; nullptr if nothing registers it. It is never
  /// destroyed. Throws Error if the program registers a name with two layouts.
  const MessageType* find(std::string_view name);
  /// All names, sorted. Throws Error as find().
  std::vector<std::string> names();

  /// Adds types of the program.
  void add(std::span<const Describe> types);
  /// Adds the types among what `library` registers, and returns whether there are any. Throws
  /// Error, and adds nothing, if one of them is known with another layout.
  bool add(std::vector<Registration>& registrations, const std::string& library);

 private:
  struct Known {
    const MessageType* type;
    std::string origin;
  };
  using Types = std::map<std::string, Known, std::less<>>;
  void describe_fresh();
  void collect(const MessageType& type, const std::string& origin, Types& types) const;

  std::mutex mutex_;
  std::vector<std::span<const Describe>> fresh_;  // the program's that are not described yet
  Types types_;
};

/// The registered message types of this process.
MessageTypes& message_types();

/// Loads a library for its message types. Throws Error if it cannot be loaded, registers no message
/// type, or registers one that is known with another layout.
/// Thread safety: from any thread. Real-time: no.
void load_message_types(const std::string& library);

/// For the macro below. While a library is being loaded it only records the types, so that a
/// library that fails its checks registers nothing. Always true.
bool register_messages(std::span<const MessageTypes::Describe> types, const char* version);

template <Message... T>
bool register_messages(const char* version) {
  static constexpr std::array<MessageTypes::Describe, sizeof...(T)> kTypes = {&message_type<T>...};
  return register_messages(kTypes, version);
}

/// Registers message types in `message_types()`, for all that know a type by its name only: the
/// command takt with `--library`, recorders and players. Use it at global scope in a .cpp file:
/// TAKT_REGISTER_MESSAGES(weather::Reading, weather::Calibrate::Request).
/// Libraries with the messages of `takt_add_messages` contain it.
#define TAKT_REGISTER_MESSAGES(...)                         \
  namespace {                                               \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_messages_) = \
      ::takt::register_messages<__VA_ARGS__>(TAKT_VERSION); \
  }

}  // namespace takt

#endif  // TAKT_MESSAGES_MESSAGE_TYPES_HPP_
