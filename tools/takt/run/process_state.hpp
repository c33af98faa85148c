// What a process of a system reports to its parent about its container: endpoints and nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROCESS_STATE_HPP_
#define TAKT_TOOLS_TAKT_PROCESS_STATE_HPP_

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "takt/containers/container.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {

struct ProcessState {
  struct Endpoint : rt::Run::Topic {
    std::uint64_t id = 0;
    bool operator==(const Endpoint&) const = default;
  };
  std::vector<Endpoint> endpoints;
  std::vector<std::vector<std::string>> nodes;  // name, type, where
  bool serves_itself = false;                   // by DDS
  std::uint64_t pending = 0;
  bool operator==(const ProcessState&) const = default;
};

ProcessState state_of(const Container& container, bool serves_itself);

/// The endpoints for the results: those of topics, without services.
void add_topics(rt::Run& run, const std::string& process,
                const std::vector<ProcessState::Endpoint>& endpoints);

/// Throws ConfigurationError if nodes have the same name.
void check_names(const std::vector<ProcessState>& processes);

}  // namespace takt::tools

namespace takt {

template <>
inline constexpr auto kFields<tools::ProcessState::Endpoint> = std::tuple{
    BasePart<rt::Run::Topic>{},
    keep("id", &tools::ProcessState::Endpoint::id, ""),
};
template <>
inline constexpr auto kFields<tools::ProcessState> = std::tuple{
    keep("endpoints", &tools::ProcessState::endpoints, ""),
    keep("nodes", &tools::ProcessState::nodes, ""),
    keep("serves_itself", &tools::ProcessState::serves_itself, ""),
    keep("pending", &tools::ProcessState::pending, ""),
};

}  // namespace takt

#endif  // TAKT_TOOLS_TAKT_PROCESS_STATE_HPP_
