// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/scheduling.hpp"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

std::string name_of_task(std::uint32_t process, std::uint32_t thread) {
  std::string name;
  std::getline(std::ifstream(fmt::format("/proc/{}/task/{}/comm", process, thread)), name);
  return name;
}

}  // namespace

Scheduling::Scheduling() {
  const auto cpus = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  try {
    for (int cpu = 0; cpu < cpus; ++cpu) {
      cpus_.emplace_back(cpu, std::make_unique<SwitchRecords>(cpu, SwitchRecords::Full::overwrites,
                                                              /*has_wakeups=*/true));
    }
  } catch (const Error& error) {
    cpus_.clear();
    missing_ = fmt::format(
        "no switches of threads: {}; they need CAP_PERFMON, or kernel.perf_event_paranoid at 0",
        error.what());
    return;
  }
  if (const std::string& why = cpus_.front().second->without_wakeups(); !why.empty())
    missing_ = "no wake-ups: " + why;
}

Scheduling::Seen Scheduling::end() {
  Seen seen{.missing = missing_};
  for (const auto& [cpu, records] : cpus_) {
    records->visit([&, number = cpu](const SwitchRecords::Switch& change) {
      Event event;
      static_cast<SwitchRecords::Switch&>(event) = change;
      event.cpu = number;
      seen.events.push_back(event);
    });
  }
  cpus_.clear();
  std::stable_sort(seen.events.begin(), seen.events.end(),
                   [](const Event& a, const Event& b) { return a.time < b.time; });
  for (const Event& event : seen.events) {
    const auto add = [&](std::uint32_t process, std::uint32_t thread) {
      if (thread == 0 || process == 0 || seen.names.contains(thread)) return;
      if (std::string name = name_of_task(process, thread); !name.empty())
        seen.names.emplace(thread, std::move(name));
    };
    add(event.process, event.thread);
    add(event.next_process, event.next_thread);
  }
  return seen;
}

}  // namespace takt
