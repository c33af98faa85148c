// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {

std::string_view to_string(EntityKind kind) noexcept {
  static constexpr std::string_view kNames[] = {"timer", "subscription", "service", "client",
                                                "waitable"};
  return kNames[static_cast<std::size_t>(kind)];
}

template class Registry<Scheduler, SchedulerTraits, const OwnValues&>;

SchedulerRegistry& schedulers() {
  static SchedulerRegistry registry("scheduler");
  return registry;
}

}  // namespace takt
