// The virtual machine that a description states.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SIMULATED_MACHINE_HPP_
#define TAKT_CONTAINERS_SIMULATION_SIMULATED_MACHINE_HPP_

#include "takt/base/cpu_model.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/measured_model.hpp"
#include "takt/containers/simulation/scenario.hpp"

namespace takt {

/// The distribution to draw an overhead from: the measured one, unless the file states the
/// overhead.
MeasuredTimes drawn_overhead(const std::optional<Nanoseconds>& stated,
                             const MeasuredModel* measured, MeasuredTimes MeasuredModel::*overhead);

/// The CPUs of the machine, and their overheads, which the scenario may draw.
CpuModel::Options machine_of(const SystemDescription& system, const MeasuredModel* measured,
                             const Scenario& scenario);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATED_MACHINE_HPP_
