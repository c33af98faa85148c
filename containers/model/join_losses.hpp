// What is lost where a join waits for several inputs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_
#define TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_

#include <cstddef>
#include <functional>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/model/system_model.hpp"

namespace TAKT_INTERNAL takt {

/// What may be lost at one callback, of how many; empty: nothing.
struct Loss {
  std::string why;
  analysis::Count one_of = 1;  // of so many one comes through; 0: of none it is known
};

/// Of messages of `from` that a join before `to` waits with: all its other inputs must come, and so
/// often that none of `from` is replaced by its next one. `loss_at`: what is lost at a callback.
/// Thread safety: a pure function. Real-time: no.
Loss loss_of_join(const SystemModel& model, const analysis::Bounds& bounds, std::size_t from,
                  std::size_t to, const std::function<std::string(std::size_t)>& why_lost_at);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_
