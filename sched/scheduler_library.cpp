// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler_library.hpp"

#include "takt/base/library.hpp"
#include "takt/sched/scheduler.hpp"
#include "takt/sched/scheduler_check.hpp"

namespace takt {

bool register_scheduler(std::string name, SchedulerRegistry::Entry entry, const char* version) {
  return register_in(schedulers(), std::move(name), std::move(entry), version);
}

void load_scheduler(const std::string& name, const std::string& library, const OwnValues& own) {
  load_registered(schedulers(), name, library, [&](const auto& entry) {
    check_scheduler(name, [&] { return entry.factory(own); });
  });
}

}  // namespace takt
