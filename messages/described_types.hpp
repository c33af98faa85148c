// Message types that are known at run time only, by ROS 2's description of them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_DESCRIBED_TYPES_HPP_
#define TAKT_MESSAGES_DESCRIBED_TYPES_HPP_

#include <map>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"
#include "takt/messages/type_description.hpp"

namespace TAKT_PUBLIC takt {

/// The types of one description: names and fields, for those that read and write bytes field by
/// field. No program has a C++ type of them, so they have no size and encode nothing.
/// Thread safety: immutable.
/// Real-time: no; it allocates.
class DescribedTypes {
 public:
  /// The description is untrusted. Throws Error if it lacks a type that it refers to, describes one
  /// twice, contains a type in itself, has a field type that Takt does not know, describes messages
  /// that have 1 GB at least, or more than 1,000 types.
  explicit DescribedTypes(const TypeDescription& description);
  DescribedTypes(const DescribedTypes&) = delete;
  DescribedTypes& operator=(const DescribedTypes&) = delete;

  /// The type with this name; nullptr if the description has none.
  const MessageType* find(std::string_view name) const;

 private:
  using Individual = type_description_interfaces::msg::IndividualTypeDescription;
  void add(const Individual& type);
  void add_fields(const Individual& type);

  std::map<std::string, MessageType, std::less<>> types_;
};

}  // namespace takt

#endif  // TAKT_MESSAGES_DESCRIBED_TYPES_HPP_
