// The kernel's context switches and wake-ups on all CPUs, beside a trace of callbacks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_SCHEDULING_HPP_
#define TAKT_CONTAINERS_WATCHING_SCHEDULING_HPP_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/watching/switch_records.hpp"

namespace TAKT_INTERNAL takt {

/// The last switches and wake-ups of all CPUs, from the construction to end(). Thread safety: none.
/// Real-time: no; 1 MiB a CPU, see SwitchRecords.
class Scheduling {
 public:
  struct Event : SwitchRecords::Switch {
    int cpu = 0;
  };
  /// The recorded events.
  struct Seen {
    std::vector<Event> events;                   // by time
    std::map<std::uint32_t, std::string> names;  // of threads that still exist at the end
    std::string missing;                         // what is missing, and why; empty: nothing
  };

  Scheduling();
  Seen end();

 private:
  std::vector<std::pair<int, std::unique_ptr<SwitchRecords>>> cpus_;
  std::string missing_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_SCHEDULING_HPP_
