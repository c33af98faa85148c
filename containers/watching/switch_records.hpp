// The context switches and wake-ups of a CPU, as the kernel records them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_SWITCH_RECORDS_HPP_
#define TAKT_CONTAINERS_WATCHING_SWITCH_RECORDS_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The context switches of a CPU and, where tracefs is mounted and readable, its wake-ups:
/// perf_event_open(2) writes them into a ring buffer of 1 MiB.
/// Thread safety: none. Real-time: no; each switch costs the kernel two records of 32 bytes.
class SwitchRecords {
 public:
  /// The policy for a full ring buffer.
  enum class Full {
    loses,       // new records: for a reader that polls
    overwrites,  // the oldest records: for a reader that reads once, at the end
  };
  struct Switch {
    TimePoint time{};                                 // of CLOCK_MONOTONIC
    std::uint32_t process = 0, thread = 0;            // switched out; or the waker
    std::uint32_t next_process = 0, next_thread = 0;  // switched in; or woken: without process
    bool was_preempted = false;                       // else it went to sleep
    bool is_wakeup = false;
  };
  using Visit = std::function<void(const Switch&)>;

  /// Throws Error if Linux does not permit it. `has_wakeups`: records wake-ups, too.
  SwitchRecords(int cpu, Full full, bool has_wakeups = false);
  ~SwitchRecords();
  SwitchRecords(const SwitchRecords&) = delete;
  SwitchRecords& operator=(const SwitchRecords&) = delete;

  /// Calls `visit` with each switch since the last call, or, with Full::overwrites, with all that
  /// are left; from the oldest to the newest. Returns false if some were not recorded.
  bool visit(const Visit& visit);
  /// Why there are no wake-ups; empty: there are.
  const std::string& without_wakeups() const noexcept { return without_wakeups_; }

 private:
  struct Header {
    std::uint32_t type;
    std::uint16_t misc, size;
  };
  template <class T>
  T read(std::uint64_t at) const;
  void visit_one(const Header& header, std::uint64_t at, const Visit& visit);
  bool visit_new(const Visit& visit);
  void visit_all(const Visit& visit);
  void open_wakeups(int cpu);

  const Full full_;
  const std::size_t page_;
  int fd_ = -1, wakeups_fd_ = -1;
  std::size_t woken_at_ = 0;                 // offset in a record of the tracepoint
  std::uint32_t comes_ = ~std::uint32_t{0};  // the thread that runs after the last switch
  void* memory_ = nullptr;
  std::string without_wakeups_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_SWITCH_RECORDS_HPP_
