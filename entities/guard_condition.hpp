// A callback that any thread can trigger.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_GUARD_CONDITION_HPP_
#define TAKT_ENTITIES_GUARD_CONDITION_HPP_

#include <atomic>
#include <functional>

#include "takt/base/clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {

/// Triggered from anywhere; several triggers before the callback starts count as one.
/// Thread safety: every method from any thread.
/// Real-time: trigger neither blocks nor allocates.
class GuardCondition : public Entity {
 public:
  using SharedPtr = std::shared_ptr<GuardCondition>;

  GuardCondition(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
                 std::function<void()> callback);

  void trigger() noexcept;

  std::size_t ready_count() const noexcept override { return sequence_.load() != 0 ? 1 : 0; }
  bool front(Arrival& arrival) const noexcept override;
  bool take(Slot& slot) noexcept override;
  bool takes_briefly() const noexcept override { return true; }
  void execute(Slot& slot) override;

 private:
  Clock& clock_;
  const std::function<void()> callback_;
  std::atomic<std::uint64_t> sequence_{0};  // of the first trigger that is outstanding; 0: none
  std::atomic<TimePoint> ready_time_{};
};

}  // namespace takt

#endif  // TAKT_ENTITIES_GUARD_CONDITION_HPP_
