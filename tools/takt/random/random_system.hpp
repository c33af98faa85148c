// Random systems of takt::Workload components, as configuration files describe them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RANDOM_SYSTEM_HPP_
#define TAKT_TOOLS_TAKT_RANDOM_SYSTEM_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace takt::tools {

struct RandomOptions {
  std::uint64_t seed = 0;
  std::vector<std::string> executors, schedulers;  // registered names to choose from
  std::vector<int> cpus;                           // for the threads
};

/// All types but those that take a band of priorities, whose threads are not drawn.
std::vector<std::string> executors_to_draw();

struct RandomSystem {
  nlohmann::ordered_json document;  // for yaml_file()
  double utilisation = 0;           // of the executor that has most to do, of its part of the CPUs
};

/// The same options give the same one.
///
/// testing/random_system.hpp makes other systems, for the proofs of analysis/: of few integers, so
/// that coincidences occur; with joins and messages from outside; without names. What it draws
/// must not change, as tests keep its seeds.
RandomSystem random_system(const RandomOptions& options);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RANDOM_SYSTEM_HPP_
