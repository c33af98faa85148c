// A polling server (Lehoczky, Sha, Strosnider, RTSS 1987): it serves for at most a budget in each
// period. When it finds nothing to serve, it gives the rest of its budget away.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"
using namespace takt;

class PollingServer final : public Rule {
 public:
  explicit PollingServer(const ExecutorOptions& options) {
    const OwnValue* budget = find(options.own, "budget");
    const OwnValue* period = find(options.own, "period");
    if (budget == nullptr && period == nullptr) return;  // no limit
    if (budget == nullptr) period->refuse("it needs the key 'budget', too");
    if (period == nullptr) budget->refuse("it needs the key 'period', too");
    budget_ = budget->as_duration();
    period_ = period->as_duration();
    if (budget_ <= Nanoseconds::zero() || budget_ > period_)
      budget->refuse("it is not above 0 and at most the period");
  }
  void begin(TimePoint now) noexcept override { next_refill_ = now; }
  bool look(TimePoint now, const ReadyCallbacks& ready) noexcept override {
    if (!is_limited()) return false;
    if (now >= next_refill_) {
      left_ = budget_;
      next_refill_ = later(next_refill_, ((now - next_refill_) / period_ + 1) * period_);
    }
    if (!ready.any()) left_ = Nanoseconds::zero();
    return false;
  }
  bool is_open() const noexcept override { return !is_limited() || left_ > Nanoseconds::zero(); }
  TimePoint opens_at() const noexcept override { return is_limited() ? next_refill_ : kNever; }
  void done(const ReadyCallback&, std::uint64_t, Nanoseconds execution_time) noexcept override {
    left_ -= execution_time;
  }

 private:
  bool is_limited() const noexcept { return budget_ > Nanoseconds::zero(); }

  Nanoseconds budget_{0}, period_{0}, left_{0};
  TimePoint next_refill_{};
};
TAKT_REGISTER_EXECUTOR("polling_server", "a budget in each period", .readiness = Readiness::events,
                       .scheduler = "fifo", .rule = make_rule<PollingServer>,
                       .keys = {{"budget", "it serves for at most this time in each period"},
                                {"period", "when the budget is full again"}})
