// Messages that a join loses while it waits for its other inputs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_
#define TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_

#include <cstddef>
#include <functional>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/model/system_model.hpp"

namespace TAKT_INTERNAL takt {

/// Which messages may be lost at a callback, and how many; empty: none.
struct Loss {
  std::string why;
  analysis::Count one_of = 1;  // at least one of so many comes through; 0: not known
};

/// The loss of messages of `from` at a join before `to`: the join replaces a message that still
/// waits for other inputs when the next one of `from` comes. `why_lost_at`: why a callback loses
/// messages.
/// Thread safety: a pure function. Real-time: no.
Loss loss_of_join(const SystemModel& model, const analysis::Bounds& bounds, std::size_t from,
                  std::size_t to, const std::function<std::string(std::size_t)>& why_lost_at);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_JOIN_LOSSES_HPP_
