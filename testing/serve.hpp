// Runs what is ready of an entity, as an executor does.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_SERVE_HPP_
#define TAKT_TESTING_SERVE_HPP_

#include "takt/entities/entity.hpp"

namespace takt {

/// False if nothing was ready.
inline bool serve(Entity& entity) {
  Slot slot;
  if (!entity.take(slot)) return false;
  entity.execute(slot);
  return true;
}

}  // namespace takt

#endif  // TAKT_TESTING_SERVE_HPP_
