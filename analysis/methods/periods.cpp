// Logical execution time: what arrives waits for the end of a period, and what is sent for the end
// of the next. Henzinger, Horowitz, Kirsch: "Giotto: A Time-Triggered Language for Embedded
// Programming" (2001); that several messages of one callback wait for several periods is our own.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Periods final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.threads != 1) return Answer::none("several threads");
    if (!part.supply.holds_in_any_window()) {
      return Answer::none("more urgent threads of its CPU may be behind when a period ends");
    }
    if (!part.fits_into_period()) {
      return Answer::none("its callbacks together may take longer than the period");
    }
    const Time waits = time_until_taken(part, path.last());
    if (waits >= kUnbounded) return Answer::none("messages may come more often than periods end");
    const Time ends = part.supply.time_for(part.snapshot_until(path.last()), part.limit);
    std::vector<Term> terms;
    if (part.explains) {
      terms = {{"until a period ends and it is taken", waits},
               {"callbacks that were taken with it, and itself", ends}};
      part.finish(terms, plus(waits, ends), 0);
    }
    return with_what_precedes(path, plus(waits, ends), std::move(terms));
  }

 private:
  // One message is taken at the end of each period. What this executor sends comes then, and is
  // taken at once; what comes from outside may have just missed it.
  static Time time_until_taken(const Part& part, std::size_t callback) {
    const Time period = part.executor.let_period;
    const bool comes_from_outside =
        std::any_of(part.sources.begin(), part.sources.end(),
                    [&](const Source& source) { return source.callback == callback; });
    const Time first = comes_from_outside ? period : 0;
    if (part.at(callback).has_one_release()) return first;
    const auto arrivals = part.inner_arrivals(callback);
    const Time busy = least_fixed_point(
        [&](Time window) { return times(most(arrivals, window), period); }, part.limit);
    if (busy >= kUnbounded) return kUnbounded;
    Time longest = 0;
    for (const Time offset : steps(arrivals, busy)) {
      const Count before = most(arrivals, offset + 1) - 1;
      longest = std::max(longest, first + before * period - offset);
    }
    return longest;
  }
};

}  // namespace
TAKT_REGISTER_METHOD("periods", "logical execution time", Periods,
                     .assumes =
                         "one thread, no more urgent one on its CPU; all callbacks together take "
                         "no longer than the period",
                     .source = "Henzinger, Horowitz, Kirsch, 2001; for queues: our own",
                     .is_for_let = true)
}  // namespace takt::analysis
