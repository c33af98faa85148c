// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/described_types.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

namespace wire = type_description_interfaces::msg;

// Limit: bytes of a message whose type another process describes. At it: the type is refused. Seen:
// the error.
constexpr std::size_t kMostBytes = std::size_t{1} << 26;
// Limit: types in such a description. At it: the type is refused. Seen: the error.
constexpr std::size_t kMostTypes = 1000;

bool is_known(const FieldShape& shape) {
  if (shape.id / FieldShape::kArray > FieldShape::kSequence / FieldShape::kArray) return false;
  switch (shape.element()) {
    case FieldShape::nested:
    case FieldShape::int8:
    case FieldShape::uint8:
    case FieldShape::int16:
    case FieldShape::uint16:
    case FieldShape::int32:
    case FieldShape::uint32:
    case FieldShape::int64:
    case FieldShape::uint64:
    case FieldShape::float32:
    case FieldShape::float64:
    case FieldShape::character:
    case FieldShape::boolean:
    case FieldShape::byte:
    case FieldShape::string:
    case FieldShape::wide_string:
    case FieldShape::bounded_string:
    case FieldShape::bounded_wide_string:
      return true;
  }
  return false;
}

/// Computes the least number of bytes of a message, each type once.
class LeastSize {
 public:
  std::size_t of(const MessageType& type) {
    const auto [entry, is_new] = sizes_.try_emplace(&type, kUnderWay);
    if (!is_new) {
      if (entry->second == kUnderWay) {
        throw Error(fmt::format("the description of {} contains the type in itself", type.name));
      }
      return entry->second;
    }
    std::size_t size = type.fields.empty() ? 1 : 0;
    for (const MessageField& field : type.fields) {
      const FieldShape& shape = field.shape;
      const std::size_t element = shape.type != nullptr ? of(*shape.type) : 1;
      const std::size_t count = shape.is_array() ? shape.capacity : 1;
      // What a sequence or array of none contains is looked at all the same.
      if (count > kMostBytes / element || size + count * element > kMostBytes) {
        throw Error(
            fmt::format("the description of {} has more than {} bytes", type.name, kMostBytes));
      }
      size += count * element;
    }
    return sizes_[&type] = std::max<std::size_t>(size, 1);
  }

 private:
  static constexpr std::size_t kUnderWay = 0;
  std::map<const MessageType*, std::size_t> sizes_;
};

}  // namespace

DescribedTypes::DescribedTypes(const TypeDescription& description) {
  const auto& others = description.referenced_type_descriptions;
  if (others.size() > kMostTypes) {
    throw Error(
        fmt::format("a description contains {} types; {} are too many", others.size(), kMostTypes));
  }
  add(description.type_description);
  for (const Individual& other : others) add(other);
  add_fields(description.type_description);
  for (const Individual& other : others) add_fields(other);
  LeastSize least_size;
  for (const auto& [name, type] : types_) least_size.of(type);
}

void DescribedTypes::add(const Individual& type) {
  const std::string& name = type.type_name.get();
  if (!types_.try_emplace(name, MessageType{.name = name, .is_serialized = true}).second) {
    throw Error(fmt::format("a description contains the type {} twice", name));
  }
}

void DescribedTypes::add_fields(const Individual& type) {
  const std::string& name = type.type_name.get();
  MessageType& place = types_.at(name);
  if (type.fields.size() == 1 && type.fields[0].name == kNoFields) return;
  for (const wire::Field& field : type.fields) {
    FieldShape shape{field.type.type_id, field.type.capacity, field.type.string_capacity};
    if (!is_known(shape)) {
      throw Error(
          fmt::format("Takt does not know the type of the field '{}' of {}", field.name, name),
          "it is none of ROS 2's .msg files");
    }
    if (shape.element() == FieldShape::nested) {
      shape.type = find(field.type.nested_type_name.get());
      if (shape.type == nullptr) {
        throw Error(fmt::format("the description of {} lacks the type of its field '{}', {}", name,
                                field.name, field.type.nested_type_name.get()));
      }
    }
    place.fields.push_back({.name = field.name,
                            .fixed_size = false,
                            .shape = shape,
                            .default_value = field.default_value});
  }
}

const MessageType* DescribedTypes::find(std::string_view name) const {
  const auto found = types_.find(name);
  return found != types_.end() ? &found->second : nullptr;
}

}  // namespace takt
