// Real and simulated time of nodes.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/nodes/node.hpp"
#include "takt/nodes/node_state.hpp"

namespace takt {

namespace {
Time stamp_of(Clock& clock) noexcept {
  const auto simulated = clock.as_simulated();
  const bool is_real =
      clock.as_manual() == nullptr && (simulated == nullptr || !simulated->simulates());
  return is_real ? Time(std::chrono::system_clock::now()) : Time(clock.now().time_since_epoch());
}
}  // namespace

Time Node::now() const noexcept {
  return stamp_of(clock_);
}

std::function<Time()> stamps_of(const Node& node) {
  return [own = node.clock().as_simulated(), &clock = node.clock()] { return stamp_of(clock); };
}

void Node::declare_use_sim_time() {
  const bool simulated =
      declare_parameter(kUseSimTime, false, {.description = "Timers follow /clock."});
  if (own_clock_ != nullptr) {
    simulate_time(simulated);
  } else if (simulated && clock_.as_simulated() == nullptr) {
    log(LogLevel::warn, "{} is true, but nothing sets the node's time", kUseSimTime);
  }
  state_->parameters.set_own(
      [this](const Parameters& changed) {
        const auto found = changed.find(kUseSimTime);
        if (found == changed.end() || own_clock_ != nullptr) return;
        if (found->second == get_parameter<ParameterValue>(kUseSimTime)) return;
        throw Error(fmt::format("nothing sets the time of node '{}'", name_),
                    "give it a time source, or load it into a container that has `dds` or a thread "
                    "called 'container'");
      },
      [this](const Parameters& values) {
        const auto found = values.find(kUseSimTime);
        if (found == values.end() || own_clock_ == nullptr) return;
        const bool wanted = std::get<bool>(found->second);
        if (wanted != own_clock_->simulates()) simulate_time(wanted);
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
