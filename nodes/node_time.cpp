// Real and simulated time of nodes.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/nodes/node.hpp"

namespace takt {

// The callback is the first that is added, so it is called last: when no other refuses.
void Node::declare_use_sim_time() {
  const bool simulated =
      declare_parameter(kUseSimTime, false, {.description = "Timers follow /clock."});
  if (own_clock_ != nullptr) {
    simulate_time(simulated);
  } else if (simulated && clock_.as_simulated() == nullptr) {
    log(LogLevel::warn, "{} is true, but nothing sets the node's time", kUseSimTime);
  }
  switch_clock_ = add_on_set_parameters_callback([this](const Parameters& values) {
    const auto found = values.find(kUseSimTime);
    if (found == values.end()) return SetParametersResult();
    const bool wanted = std::get<bool>(found->second);
    if (wanted == get_parameter<bool>(kUseSimTime)) return SetParametersResult();
    if (own_clock_ == nullptr) {
      return SetParametersResult{
          false, fmt::format("nothing sets the time of node '{}'; give it a time source, or load "
                             "it into a container that has `dds` or a thread called 'container'",
                             name_)};
    }
    try {
      simulate_time(wanted);
    } catch (const Error& error) {
      return SetParametersResult{false, error.what()};
    }
    return SetParametersResult();
  });
}

void Node::simulate_time(bool simulated) {
  if (!simulated) {
    options_.time_source->leave(*own_clock_);
    return own_clock_->simulate(false);
  }
  own_clock_->simulate(true);
  try {
    options_.time_source->follow(own_clock_);
  } catch (...) {
    own_clock_->simulate(false);
    throw;
  }
}

}  // namespace takt
