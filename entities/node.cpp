// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <mutex>

namespace takt {
namespace {

// ROS 2's rule for one part of a name.
bool is_name(std::string_view name) {
  return !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) == 0 &&
         std::all_of(name.begin(), name.end(), [](unsigned char character) {
           return std::isalnum(character) != 0 || character == '_';
         });
}

void check_name(std::string_view name, std::string_view what) {
  if (!is_name(name)) {
    throw Error(fmt::format("'{}' cannot be the name of a {}", name, what),
                "use letters, digits and '_', not beginning with a digit");
  }
}

void check_path(std::string_view path, std::string_view what) {
  std::string_view rest = path.substr(std::min<std::size_t>(path.size(), 1));
  for (;;) {
    const std::size_t slash = rest.find('/');
    if (!path.starts_with('/') || !is_name(rest.substr(0, slash))) {
      throw Error(fmt::format("'{}' cannot be the name of a {}", path, what),
                  "use letters, digits and '_' between slashes: '/front/scan'");
    }
    if (slash == std::string_view::npos) return;
    rest.remove_prefix(slash + 1);
  }
}

std::string absolute_name_space(std::string_view name_space) {
  if (name_space.empty() || name_space == "/") return {};
  std::string result(name_space.starts_with('/') ? "" : "/");
  result += name_space;
  check_path(result, "namespace");
  return result;
}

}  // namespace

std::string_view type_name(const ParameterValue& value) noexcept {
  static constexpr std::string_view kNames[] = {
      "boolean",       "integer",       "floating-point number",       "string",
      "boolean array", "integer array", "floating-point number array", "string array"};
  return kNames[value.index()];
}

Node::Node(std::string_view name, const NodeOptions& options)
    : options_(options),
      name_(options.name.empty() ? std::string(name) : options.name),
      name_space_(absolute_name_space(options.name_space)),
      default_group_(
          std::make_shared<CallbackGroup>("default", CallbackGroupType::MutuallyExclusive)) {
  check_name(name_, "node");
  groups_.push_back(default_group_);
}

std::string Node::fully_qualified_name() const { return name_space_ + "/" + name_; }

std::shared_ptr<CallbackGroup> Node::create_callback_group(std::string name, CallbackGroupType type,
                                                           bool automatically_add_to_executor) {
  check_name(name, "callback group");
  const std::vector<std::shared_ptr<CallbackGroup>> existing = groups();
  if (std::any_of(existing.begin(), existing.end(),
                  [&](const auto& group) { return group->name() == name; })) {
    throw Error(fmt::format("node '{}' has two callback groups called '{}'", name_, name),
                "give each group of a node its own name");
  }
  auto group =
      std::make_shared<CallbackGroup>(std::move(name), type, automatically_add_to_executor);
  std::vector<NodeListener*> listeners;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(groups_, [](const auto& known) { return known.expired(); });
    groups_.push_back(group);
    listeners = listeners_;
  }
  for (NodeListener* listener : listeners) listener->group_added(*this, group);
  return group;
}

std::shared_ptr<CallbackGroup> Node::group_or_default(std::shared_ptr<CallbackGroup> group) const {
  return group != nullptr ? std::move(group) : default_group_;
}

void Node::add(const std::shared_ptr<Entity>& entity) {
  const std::vector<std::shared_ptr<CallbackGroup>> known = groups();
  if (std::find(known.begin(), known.end(), entity->group()) == known.end()) {
    throw Error(fmt::format("'{}' of node '{}' was given a callback group of another node",
                            entity->name(), name_));
  }
  std::vector<NodeListener*> listeners;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(entities_, [](const auto& old) { return old.expired(); });
    entities_.push_back(entity);
    listeners = listeners_;
  }
  for (NodeListener* listener : listeners) listener->entity_added(*this, entity);
}

std::shared_ptr<Timer> Node::create_timer(std::string name, Nanoseconds period,
                                          std::function<void()> callback,
                                          std::shared_ptr<CallbackGroup> group) {
  check_name(name, "timer");
  return adopt<Timer>(std::make_shared<Timer>(std::move(name), group_or_default(std::move(group)),
                                              clock(), period, std::move(callback)));
}

std::shared_ptr<GuardCondition> Node::create_guard_condition(std::string name,
                                                             std::function<void()> callback,
                                                             std::shared_ptr<CallbackGroup> group) {
  check_name(name, "guard condition");
  return adopt<GuardCondition>(std::make_shared<GuardCondition>(
      std::move(name), group_or_default(std::move(group)), clock(), std::move(callback)));
}

std::string Node::resolve(std::string_view topic) {
  std::string_view name = topic;
  if (const auto found = options_.remap.find(topic); found != options_.remap.end()) {
    const std::lock_guard lock(mutex_);
    used_remaps_.emplace(topic);
    name = found->second;
  }
  std::string result;
  if (name.starts_with("~/")) {
    result = fully_qualified_name() + std::string(name.substr(1));
  } else if (name.starts_with('/')) {
    result = name;
  } else {
    result = name_space_ + "/" + std::string(name);
  }
  check_path(result, "topic");
  return result;
}

const ParameterValue& Node::declare(std::string_view name, ParameterValue value) {
  const std::lock_guard lock(mutex_);
  const auto [parameter, is_new] = parameters_.try_emplace(std::string(name), std::move(value));
  if (!is_new) throw Error(fmt::format("parameter '{}' of node '{}' is declared twice", name, name_));
  if (const auto given = options_.parameters.find(name); given != options_.parameters.end()) {
    const bool integer_for_double = std::holds_alternative<double>(parameter->second) &&
                                    std::holds_alternative<std::int64_t>(given->second);
    parameter->second = integer_for_double
                            ? ParameterValue(static_cast<double>(std::get<std::int64_t>(given->second)))
                            : given->second;
  }
  return parameter->second;
}

const ParameterValue& Node::find_parameter(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  if (const auto found = parameters_.find(name); found != parameters_.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [declared, value] : parameters_) names.push_back(declared);
  throw Error(fmt::format("node '{}' has no parameter '{}'", name_, name), suggest(name, names));
}

void Node::throw_wrong_type(std::string_view name, const ParameterValue& is,
                            const ParameterValue& wanted) const {
  throw Error(fmt::format("parameter '{}' of node '{}' is a {}", name, name_, type_name(is)),
              fmt::format("give a {}", type_name(wanted)));
}

std::vector<std::shared_ptr<Entity>> Node::entities() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Entity>> result;
  for (const auto& entity : entities_) {
    if (auto alive = entity.lock()) result.push_back(std::move(alive));
  }
  return result;
}

std::vector<std::shared_ptr<CallbackGroup>> Node::groups() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<CallbackGroup>> result;
  for (const auto& group : groups_) {
    if (auto alive = group.lock()) result.push_back(std::move(alive));
  }
  return result;
}

void Node::add_listener(NodeListener& listener) {
  const std::lock_guard lock(mutex_);
  if (std::find(listeners_.begin(), listeners_.end(), &listener) == listeners_.end()) {
    listeners_.push_back(&listener);
  }
}

void Node::remove_listener(NodeListener& listener) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase(listeners_, &listener);
}

bool Node::claim(const NodeListener* owner) noexcept {
  const NodeListener* nobody = nullptr;
  return owner_.compare_exchange_strong(nobody, owner);
}

void Node::release(const NodeListener* owner) noexcept {
  owner_.compare_exchange_strong(owner, nullptr);
}

std::vector<std::string> Node::unused_parameters() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> result;
  for (const auto& [name, value] : options_.parameters) {
    if (!parameters_.contains(name)) result.push_back(name);
  }
  return result;
}

std::vector<std::string> Node::unused_remaps() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> result;
  for (const auto& [from, to] : options_.remap) {
    if (!used_remaps_.contains(from)) result.push_back(from);
  }
  return result;
}

}  // namespace takt
