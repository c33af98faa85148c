// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_setting.hpp"

#include <algorithm>
#include <cctype>

#include "takt/base/error.hpp"
#include "takt/containers/lttng.hpp"

namespace takt {

ContainerSetting::ContainerSetting(const SystemDescription& described,
                                   const ContainerOverrides& overridden)
    : description(described),
      overrides(overridden),
      modes(std::make_shared<Modes>(described.modes)) {
  said.lock()->notes = described.notes;
  if (!overrides.only_constructs) note(load_tracepoints_if_asked(&description));
  if (description.dds) {
    DdsOptions options = *description.dds;
    options.realtime = description.realtime;
    participant =
        overrides.participant != nullptr ? overrides.participant : Participant::create(options);
    for (const ThreadState& thread : participant->threads()) note(thread.refused);
  }
  if (needs_service_node()) time_source = std::make_shared<TimeSource>();
}

bool ContainerSetting::has_thread(const std::string& name) const {
  return find_thread(description, name) != nullptr;
}

ThreadAttributes ContainerSetting::thread(const std::string& name) const {
  const ThreadDescription* const found = find_thread(description, name);
  return found != nullptr ? found->attributes : ThreadAttributes{.name = name};
}

bool ContainerSetting::needs_service_node() const {
  const auto needs_it = [](const ComponentDescription& component) {
    const auto sim_time = component.parameters.find(kUseSimTime);
    return component.on_exception == OnException::remove_node ||
           (sim_time != component.parameters.end() && sim_time->second == ParameterValue(true));
  };
  return (participant != nullptr && !description.is_split_off) || is_seen_program() ||
         has_thread(kServiceThread) || description.lifecycle ||
         (!description.modes.empty() && !is_simulated()) ||
         std::any_of(description.components.begin(), description.components.end(), needs_it);
}

// Process names may contain characters that are invalid in node names.
std::string ContainerSetting::own_name(const char* ending) const {
  std::string name = description.name + ending;
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char character) { return std::isalnum(character) == 0; }, '_');
  if (std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(0, "_");
  return name;
}

void ContainerSetting::throw_errors() const {
  if (!errors.empty()) throw ConfigurationError(errors);
}

void ContainerSetting::note(std::string text) {
  if (!text.empty()) said.lock()->notes.push_back(std::move(text));
}

void ContainerSetting::fail(std::string text) {
  said.lock()->failures.push_back(std::move(text));
}

}  // namespace takt
