// What the parts of a container share. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_SETTING_HPP_
#define TAKT_CONTAINERS_CONTAINER_SETTING_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/base/guarded.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/modes.hpp"
#include "takt/ros2/time_source.hpp"

namespace TAKT_INTERNAL takt {

inline constexpr const char* kServiceThread = "container";

/// The description and the options of a container, and the notes and failures of its run.
/// Thread safety: `note`, `fail` and `said` from any thread; the constructor of the container alone
/// changes the rest. Real-time: no.
struct ContainerSetting {
  ContainerSetting(const SystemDescription& described, const ContainerOverrides& overridden);
  bool is_simulated() const noexcept { return overrides.execution_model != nullptr; }
  /// Whether CPUs are those of `machine` and not those of this process, because the container is
  /// analysed or simulated.
  bool is_of_machine() const noexcept {
    return !description.machine.cpus.empty() && (overrides.only_constructs || is_simulated());
  }
  /// Whether the container is of a program that makes its nodes itself, and has DDS.
  bool is_seen_program() const noexcept {
    return overrides.find_node && overrides.participant != nullptr;
  }
  /// Whether requests, failed components or simulated time need the service node, and so its
  /// thread.
  bool needs_service_node() const;
  bool has_thread(const std::string& name) const;
  ThreadAttributes thread(const std::string& name) const;
  /// The name for one of the container's own nodes.
  std::string own_name(const char* ending) const;
  void throw_errors() const;
  /// Ignores an empty text.
  void note(std::string text);
  void fail(std::string text);

  SystemDescription description;  // completed with what Takt assigns
  const ContainerOverrides overrides;
  std::vector<std::string> errors;  // of the set-up, before start
  std::shared_ptr<Participant> participant;
  std::shared_ptr<TimeSource> time_source;  // of the components; nullptr: there is no service node
  const std::shared_ptr<Modes> modes;       // shared with components and handlers
  struct Said {
    std::vector<std::string> notes, failures;
  };
  detail::Guarded<Said> said;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_SETTING_HPP_
