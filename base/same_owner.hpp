// Whether two pointers are of one object, also when it goes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SAME_OWNER_HPP_
#define TAKT_BASE_SAME_OWNER_HPP_

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Of shared or weak pointers. Makes no pointer, which might be the last one for a moment, and
/// destroy what another thread lets go.
/// Thread safety: as that of the pointers. Real-time: nothing blocks or allocates.
template <class A, class B>
bool is_same_owner(const A& a, const B& b) noexcept {
  return !a.owner_before(b) && !b.owner_before(a);
}

}  // namespace takt

#endif  // TAKT_BASE_SAME_OWNER_HPP_
