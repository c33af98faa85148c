// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void ModeReader::read(const Value& value) {
  ModeDescription mode{.name = value.name, .where = errors_.where(value.line)};
  const std::size_t before = errors_.size();
  const auto into_list = [this](std::vector<ModeDescription::Callback>& list) {
    return each_in_list([this, &list](const Value& item) {
      if (auto callback = mode_callback(item)) list.push_back(std::move(*callback));
    });
  };
  read_map(
      value, "a mode",
      {{"drop",
        "Timers and subscriptions, as `node/callback`: what arrives is discarded, and counted. A "
        "timer keeps its phase.",
        into_list(mode.drop)},
       {"demote",
        "Callbacks that run after all others of their executor. Its scheduler must be one whose "
        "order goes by urgencies or deadlines.",
        into_list(mode.demote)},
       {"on", "What leads to the mode by itself.", [&](const Value& on) {
          read_map(
              on, "what leads to a mode",
              {{"overrun",
                "A callback with a `budget` or a `deadline`, or a timer. Its overrun or its "
                "missed deadline leads to the mode, unless one further down in the file is in "
                "force.",
                [&](const Value& callback) { mode.on_overrun = mode_callback(callback); }, true}});
        }}});
  if (is_describing()) return;
  if (errors_.size() == before) check_mode(value, mode);
  system_.modes.push_back(std::move(mode));
}

std::optional<ModeDescription::Callback> ModeReader::mode_callback(const Value& value) {
  std::string name;
  into(name)(value);
  if (name.starts_with('/')) name.erase(0, 1);
  if (name.empty()) return {};
  return ModeDescription::Callback{std::move(name), errors_.where(value.line)};
}

// Whether the callbacks exist is checked later, when the components have been made.
void ModeReader::check_mode(const Value& value, const ModeDescription& mode) {
  if (mode.name == kNormalMode) {
    errors_.add(value.line, fmt::format("the mode '{}' is the one without changes", kNormalMode),
                "give yours another name");
  }
  if (mode.name.empty()) errors_.add(value.line, "a mode has no name", "give it one");
  if (mode.drop.empty() && mode.demote.empty()) {
    errors_.add(value.line, fmt::format("the mode '{}' changes nothing", mode.name),
                "list callbacks under 'drop' or 'demote'");
  }
  std::map<std::string, const char*> seen;
  const auto check = [&](const Value* list, const auto& callbacks, const char* key) {
    for (const ModeDescription::Callback& callback : callbacks) {
      const auto [other, is_new] = seen.try_emplace(callback.name, key);
      if (is_new) continue;
      errors_.add(list->line,
                  fmt::format("mode '{}' has '{}' under '{}' already", mode.name, callback.name,
                              other->second),
                  "name each callback once");
    }
  };
  check(document::find(value, "drop"), mode.drop, "drop");
  check(document::find(value, "demote"), mode.demote, "demote");
}

}  // namespace takt
