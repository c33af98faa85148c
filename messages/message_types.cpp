// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/message_types.hpp"

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/base/never_destroyed.hpp"

namespace takt {
namespace {

constexpr const char* kNoun = "message";
constexpr const char* kProgram = "the program";

using Describe = MessageTypes::Describe;

}  // namespace

MessageTypes& message_types() {
  static detail::NeverDestroyed<MessageTypes> types;
  return *types;
}

const MessageType* MessageTypes::find(std::string_view name) {
  const std::lock_guard lock(mutex_);
  describe_fresh();
  const auto found = types_.find(name);
  return found != types_.end() ? found->second.type : nullptr;
}

std::vector<std::string> MessageTypes::names() {
  const std::lock_guard lock(mutex_);
  describe_fresh();
  std::vector<std::string> result;
  for (const auto& [name, known] : types_) result.push_back(name);
  return result;
}

void MessageTypes::add(std::span<const Describe> types) {
  const std::lock_guard lock(mutex_);
  fresh_.push_back(types);
}

bool MessageTypes::add(std::vector<Registration>& registrations, const std::string& library) {
  const std::lock_guard lock(mutex_);
  std::vector<Registration*> of_messages;
  for (Registration& registration : registrations) {
    if (registration.noun == kNoun) of_messages.push_back(&registration);
  }
  if (of_messages.empty()) return false;
  describe_fresh();
  Types more;
  for (const Registration* registration : of_messages) {
    if (registration->is_added) continue;
    for (const Describe describe : std::any_cast<std::span<const Describe>>(registration->entry)) {
      collect(describe(), fmt::format("library '{}'", library), more);
    }
  }
  types_.merge(more);
  for (Registration* registration : of_messages) registration->is_added = true;
  return true;
}

void MessageTypes::describe_fresh() {
  for (const auto& types : fresh_) {
    for (const Describe describe : types) collect(describe(), kProgram, types_);
  }
  fresh_.clear();
}

// Adds the type, and those of its fields, to `types`.
void MessageTypes::collect(const MessageType& type, const std::string& origin, Types& types) const {
  const auto check = [&](const Known& known) {
    if (known.type->layout_hash == type.layout_hash) return;
    throw Error(known.origin == origin
                    ? fmt::format("{} registers the message type {} with two different layouts",
                                  origin, type.name)
                    : fmt::format("{} and {} register the message type {} with different layouts",
                                  known.origin, origin, type.name),
                "build all with the same definition of it");
  };
  if (const auto known = types_.find(type.name); known != types_.end()) {
    return check(known->second);
  }
  const auto [known, is_new] = types.try_emplace(type.name, Known{&type, origin});
  if (!is_new) return check(known->second);
  for (const MessageField& field : type.fields) {
    if (field.shape.type != nullptr) collect(*field.shape.type, origin, types);
  }
}

void load_message_types(const std::string& library) {
  if (message_types().add(load_library(library), library)) return;
  throw Error(
      fmt::format("library '{}' registers no message type", library),
      "add TAKT_REGISTER_MESSAGES(Type, …) to its code, or link what takt_add_messages makes");
}

bool register_messages(std::span<const Describe> types, const char* version) {
  if (!note_registration({kNoun, {}, types, version})) message_types().add(types);
  return true;
}

}  // namespace takt
