// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/supply.hpp"

#include <algorithm>

namespace takt::analysis {

Time Supply::time_for(Time work, Time limit, Time at_least) const {
  if (work <= 0) return 0;
  if (work > limit) return kUnbounded;
  if (period_ != 0) {
    const auto granted_after = [this](Time amount) {
      const Time blackout = period_ - budget_;
      const Time periods = amount / budget_, rest = amount % budget_;
      return plus(plus(blackout, times(periods, period_)), rest > 0 ? blackout + rest : 0);
    };
    if (switches_ == nullptr) return granted_after(work);
    return least_fixed_point(
        [&](Time window) { return granted_after(plus(work, switches_(window))); }, limit,
        std::max(work, at_least));
  }
  if (above_ == nullptr && !is_throttled()) return work;
  return least_fixed_point(
      [&](Time window) {
        const Time above = above_ != nullptr ? above_(window) : 0;
        if (!is_throttled()) return plus(work, above);
        const Time periods = (window + granted_.period - 1) / granted_.period + further_;
        return plus(plus(work, above), times(periods, granted_.period - granted_.budget));
      },
      limit, std::max(work, at_least));
}

}  // namespace takt::analysis
