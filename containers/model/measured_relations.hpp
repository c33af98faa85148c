// What the facts of a measured run have to do with each other.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_MEASURED_RELATIONS_HPP_
#define TAKT_CONTAINERS_MODEL_MEASURED_RELATIONS_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/model/measured_model.hpp"

namespace TAKT_INTERNAL takt {

/// Facts of a model that no run can have shown together.
struct Contradiction {
  std::vector<std::string> at;  // keys, from the root of its file on
  std::string what;
};

/// Each relation that does not hold, in the order of one table. Facts that are not known contradict
/// nothing.
/// Thread safety: a pure function. Real-time: no.
std::vector<Contradiction> contradictions(const MeasuredModel& model);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_MEASURED_RELATIONS_HPP_
