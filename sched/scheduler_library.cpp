// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler_library.hpp"

#include <algorithm>
#include <mutex>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/sched/scheduler.hpp"
#include "takt/sched/scheduler_check.hpp"

namespace takt {
namespace {

constexpr const char* kNoun = "scheduler";

}  // namespace

bool register_scheduler(std::string name, SchedulerRegistry::Entry entry, const char* version) {
  if (!note_registration({kNoun, name, entry, version})) {
    schedulers().add(std::move(name), std::move(entry));
  }
  return true;
}

void load_scheduler(const std::string& name, const std::string& library) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::vector<Registration>& registrations = load_library(library);
  std::vector<std::string> names;
  for (const Registration& registration : registrations) {
    if (registration.noun == kNoun) names.push_back(registration.name);
  }
  const auto count = std::count(names.begin(), names.end(), name);
  if (count == 0) {
    throw Error(fmt::format("library '{}' registers no scheduler '{}'", library, name),
                names.empty() ? fmt::format("say TAKT_REGISTER_SCHEDULER(\"{}\", …) in it", name)
                              : suggest(name, names));
  }
  if (count > 1) {
    throw Error(fmt::format("library '{}' registers scheduler '{}' twice", library, name),
                "give each its own name");
  }
  Registration& registration =
      *std::find_if(registrations.begin(), registrations.end(),
                    [&](const auto& known) { return known.noun == kNoun && known.name == name; });
  if (registration.is_added) return;
  const std::vector<std::string> taken = schedulers().names();
  if (std::find(taken.begin(), taken.end(), name) != taken.end()) {
    throw Error(fmt::format("the name '{}' is taken by another scheduler", name),
                fmt::format("register it under another name than {}", fmt::join(taken, ", ")));
  }
  const auto entry = std::any_cast<SchedulerRegistry::Entry>(registration.entry);
  check_scheduler(name, entry.factory);
  schedulers().add(name, entry);
  registration.is_added = true;
}

}  // namespace takt
