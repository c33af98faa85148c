// The run-time description of message types, and the macro TAKT_MESSAGE.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_MESSAGE_TYPE_HPP_
#define TAKT_MESSAGES_MESSAGE_TYPE_HPP_

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/cdr.hpp"

namespace TAKT_PUBLIC takt {

struct MessageType;

/// A field's type as ROS 2 describes it (REP 2016, type_description_interfaces/msg/FieldType).
struct FieldShape {
  enum Id : std::uint8_t {
    nested = 1,
    int8 = 2,
    uint8 = 3,
    int16 = 4,
    uint16 = 5,
    int32 = 6,
    uint32 = 7,
    int64 = 8,
    uint64 = 9,
    float32 = 10,
    float64 = 11,
    character = 13,
    boolean = 15,
    byte = 16,
    string = 17,
    wide_string = 18,
    bounded_string = 21,
    bounded_wide_string = 22,
  };
  /// Added to the id of the element type.
  static constexpr std::uint8_t kArray = 48, kBoundedSequence = 96, kSequence = 144;

  std::uint8_t id = 0;
  std::size_t capacity = 0;           // of an array or a bounded sequence
  std::size_t string_capacity = 0;    // of a bounded string
  const MessageType* type = nullptr;  // of a nested message

  Id element() const noexcept { return static_cast<Id>(id % kArray); }
  bool is_array() const noexcept { return id / kArray == 1; }
  bool is_sequence() const noexcept { return id / kArray >= 2; }
};

/// One field: its name, its IDL type ("uint32", "sequence<float>"), and its offset.
struct MessageField {
  std::string name;
  std::string type;
  std::size_t offset = 0;
  bool fixed_size = true;
  FieldShape shape;
  std::string default_value;  // as a definition has it, of a type that no program has
};

/// One message type. Publishers and subscriptions match by name and layout hash.
/// Thread safety: immutable.
struct MessageType {
  std::string name;  // as in ROS 2: "sensor_msgs/msg/LaserScan"; or an IDL type's: "robot::Scan"
  std::vector<MessageField> fields;
  std::size_t size = 0;
  std::size_t alignment = 0;
  bool fixed_size = true;         // no strings or sequences: copying its bytes copies the message
  bool is_serialized = false;     // only the name is known: a message is a span of bytes
  std::uint64_t layout_hash = 0;  // of all fields and nested fields: names, types, offsets
  void (*encode)(const void* message, ByteBuffer& bytes) = nullptr;
  /// Returns false if the bytes are no message of this type.
  bool (*decode)(std::span<const std::byte> bytes, void* message) = nullptr;
  /// Encodes a message whose fields nobody has set; nullptr if there is none.
  void (*encode_defaults)(ByteBuffer& bytes) = nullptr;
};

/// A type described by TAKT_MESSAGE.
template <class T>
concept Message = requires(const T* message) {
  { takt_message_type(message) } -> std::same_as<const MessageType&>;
};

template <Message T>
const MessageType& message_type() {
  return takt_message_type(static_cast<const T*>(nullptr));
}

/// The type with this name for publishers and subscriptions of encoded messages: a message is a
/// `std::span<const std::byte>`. The result is never destroyed.
/// Thread safety: from any thread. Real-time: no; it allocates.
const MessageType& serialized_type(std::string_view name);

/// The message as YAML, as ROS 2's function of this name writes it. It is defined in
/// <takt/messages/yaml.hpp>; generated messages have it in their own namespace, too.
/// Thread safety: from any thread. Real-time: no; it allocates.
template <Message M>
std::string to_yaml(const M& message, bool use_flow_style = false);

// ---- Implementation of TAKT_MESSAGE ----

namespace detail {

/// Computes size and hash from the fields.
MessageType finish_message_type(MessageType type);

// What every type would compile again, see message_type.cpp.
std::string name_of(FieldShape::Id id);
std::string name_of(const MessageType& nested);
std::string name_of_sequence(const std::string& element);
std::string name_of_array(const std::string& element, std::size_t size);
std::string name_of_bounded(const std::string& container, std::size_t most);

template <class T>
FieldShape several(std::uint8_t kind, std::size_t capacity);

template <class T>
struct FieldType {  // the general case: a nested message
  static std::string name() { return name_of(message_type<T>()); }
  static bool fixed_size() { return message_type<T>().fixed_size; }
  static FieldShape shape() { return {.id = FieldShape::nested, .type = &message_type<T>()}; }
};
template <class T>
requires std::is_arithmetic_v<T> || std::same_as<T, std::byte>
struct FieldType<T> {
  static std::string name() { return name_of(shape().element()); }
  static bool fixed_size() { return true; }
  static FieldShape shape() {
    if constexpr (std::same_as<T, bool>) return {FieldShape::boolean};
    if constexpr (std::same_as<T, std::byte>) return {FieldShape::byte};
    if constexpr (std::same_as<T, char>) return {FieldShape::character};
    if constexpr (std::same_as<T, float>) return {FieldShape::float32};
    if constexpr (std::same_as<T, double>) return {FieldShape::float64};
    // int8, uint8, int16 and so on, in this order.
    constexpr auto kSize = static_cast<std::uint8_t>(std::countr_zero(sizeof(T)));
    return {
        static_cast<std::uint8_t>(FieldShape::int8 + 2 * kSize + (std::is_unsigned_v<T> ? 1 : 0))};
  }
};
template <class T>
requires(std::is_enum_v<T> && !std::same_as<T, std::byte>) struct FieldType<T>
    : FieldType<std::underlying_type_t<T>> {
};
template <>
struct FieldType<std::string> {
  static std::string name() { return "string"; }
  static bool fixed_size() { return false; }
  static FieldShape shape() { return {FieldShape::string}; }
};
template <>
struct FieldType<std::u16string> {
  static std::string name() { return "wstring"; }
  static bool fixed_size() { return false; }
  static FieldShape shape() { return {FieldShape::wide_string}; }
};
template <class T>
struct FieldType<std::vector<T>> {
  static std::string name() { return name_of_sequence(FieldType<T>::name()); }
  static bool fixed_size() { return false; }
  static FieldShape shape() { return several<T>(FieldShape::kSequence, 0); }
};
template <class Container, std::size_t kMost>
struct FieldType<Bounded<Container, kMost>> {
  static std::string name() { return name_of_bounded(FieldType<Container>::name(), kMost); }
  static bool fixed_size() { return false; }
  static FieldShape shape() {
    if constexpr (std::same_as<Container, std::string>) {
      return {.id = FieldShape::bounded_string, .string_capacity = kMost};
    } else if constexpr (std::same_as<Container, std::u16string>) {
      return {.id = FieldShape::bounded_wide_string, .string_capacity = kMost};
    } else {
      return several<typename Container::value_type>(FieldShape::kBoundedSequence, kMost);
    }
  }
};
template <class T, std::size_t N>
struct FieldType<std::array<T, N>> {
  static std::string name() { return name_of_array(FieldType<T>::name(), N); }
  static bool fixed_size() { return FieldType<T>::fixed_size(); }
  static FieldShape shape() { return several<T>(FieldShape::kArray, N); }
};

template <class T>
FieldShape several(std::uint8_t kind, std::size_t capacity) {
  FieldShape shape = FieldType<T>::shape();
  shape.id = static_cast<std::uint8_t>(shape.id + kind);
  shape.capacity = capacity;
  return shape;
}

/// A field as the code describes it: without strings, which each type would compile again.
struct FieldDescription {
  const char* name;
  std::size_t offset;
  std::string (*type)();
  bool (*fixed_size)();
  FieldShape (*shape)();

  operator MessageField() const;  // NOLINT: it is one
};
template <class T>
constexpr FieldDescription describe_field(const char* name, std::size_t offset) {
  return {name, offset, &FieldType<T>::name, &FieldType<T>::fixed_size, &FieldType<T>::shape};
}

template <class T>
void encode_message(const void* message, ByteBuffer& bytes) {
  CdrWriter writer(bytes);
  writer(*static_cast<const T*>(message));
}
template <class T>
bool decode_message(std::span<const std::byte> bytes, void* message) {
  CdrReader reader(bytes);
  reader(*static_cast<T*>(message));
  return reader.ok();
}
template <class T>
void encode_default_message(ByteBuffer& bytes) {
  if constexpr (std::is_default_constructible_v<T>) {
    encode_message<T>(std::make_unique<T>().get(), bytes);  // it may be too large for the stack
  }
}

/// What else a type consists of.
struct MessageLayout {
  std::size_t size, alignment;
  bool fixed_size;
  void (*encode)(const void* message, ByteBuffer& bytes);
  bool (*decode)(std::span<const std::byte> bytes, void* message);
  void (*encode_defaults)(ByteBuffer& bytes);
};
template <class T>
inline constexpr MessageLayout kLayoutOf = {
    sizeof(T),          alignof(T),         std::is_trivially_copyable_v<T>,
    &encode_message<T>, &decode_message<T>, &encode_default_message<T>};

/// The result is never destroyed.
const MessageType& make_message_type(std::string_view name, const MessageLayout& layout,
                                     std::initializer_list<FieldDescription> fields);

}  // namespace detail

// ---- Common parts of generated messages ----

/// Initialization of a generated message, as in ROS 2. Every field always has a value: zero or
/// empty with ZERO, the default value of the definition otherwise.
enum class MessageInitialization { ALL, SKIP, ZERO, DEFAULTS_ONLY };

/// ROS 2's names for pointers to messages.
template <class M>
struct MessagePointers {
  using RawPtr = M*;
  using ConstRawPtr = const M*;
  using SharedPtr = std::shared_ptr<M>;
  using ConstSharedPtr = std::shared_ptr<const M>;
  using WeakPtr = std::weak_ptr<M>;
  using ConstWeakPtr = std::weak_ptr<const M>;
  using UniquePtr = std::unique_ptr<M>;
  using ConstUniquePtr = std::unique_ptr<const M>;
  friend bool operator==(const MessagePointers&, const MessagePointers&) = default;
};

// ---- TAKT_MESSAGE ----

// Applies `macro(type, field)` to each further argument, separated by commas.
#define TAKT_PARENS ()
#define TAKT_EXPAND(...) TAKT_EXPAND3(TAKT_EXPAND3(TAKT_EXPAND3(TAKT_EXPAND3(__VA_ARGS__))))
#define TAKT_EXPAND3(...) TAKT_EXPAND2(TAKT_EXPAND2(TAKT_EXPAND2(TAKT_EXPAND2(__VA_ARGS__))))
#define TAKT_EXPAND2(...) TAKT_EXPAND1(TAKT_EXPAND1(TAKT_EXPAND1(TAKT_EXPAND1(__VA_ARGS__))))
#define TAKT_EXPAND1(...) __VA_ARGS__
#define TAKT_FOR_EACH(macro, type, ...) \
  __VA_OPT__(TAKT_EXPAND(TAKT_FOR_EACH_STEP(macro, type, __VA_ARGS__)))
#define TAKT_FOR_EACH_STEP(macro, type, field, ...) \
  macro(type, field) __VA_OPT__(, TAKT_FOR_EACH_AGAIN TAKT_PARENS(macro, type, __VA_ARGS__))
#define TAKT_FOR_EACH_AGAIN() TAKT_FOR_EACH_STEP
#define TAKT_DESCRIBE_FIELD(type, field) \
  ::takt::detail::describe_field<decltype(type::field)>(#field, offsetof(type, field))

#define TAKT_VISIT_FIELD(message, field) visitor(message.field)

/// Makes an aggregate a message: `TAKT_MESSAGE(LaserScan, "sensor_msgs/msg/LaserScan", stamp,
/// ranges);`. Use it in the namespace of the aggregate, with all fields (at most 80) in the order
/// of declaration.
#define TAKT_MESSAGE(Type, type_name, ...)                                                  \
  [[maybe_unused]] inline const ::takt::MessageType& takt_message_type(const Type*) {       \
    static const ::takt::MessageType& type = ::takt::detail::make_message_type(             \
        type_name, ::takt::detail::kLayoutOf<Type>,                                         \
        {TAKT_FOR_EACH(TAKT_DESCRIBE_FIELD, Type __VA_OPT__(, ) __VA_ARGS__)});             \
    return type;                                                                            \
  }                                                                                         \
  template <class Visitor, class Message>                                                   \
  requires std::same_as<std::remove_const_t<Message>, Type>                                 \
  void takt_visit_fields(Visitor& visitor, [[maybe_unused]] Message& message) {             \
    __VA_OPT__(TAKT_FOR_EACH(TAKT_VISIT_FIELD, message, __VA_ARGS__); if constexpr (false)) \
    visitor.no_fields();                                                                    \
  }                                                                                         \
  static_assert(true, "so that the macro ends in a semicolon")

}  // namespace takt

#endif  // TAKT_MESSAGES_MESSAGE_TYPE_HPP_
