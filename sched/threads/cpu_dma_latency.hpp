// Keeps CPUs out of idle states from which they wake slowly.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_THREADS_CPU_DMA_LATENCY_HPP_
#define TAKT_SCHED_THREADS_CPU_DMA_LATENCY_HPP_

#include <string>

#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

/// While the object lives, the kernel uses no idle state that takes longer than this to leave
/// (/dev/cpu_dma_latency, kernel documentation "PM Quality of Service"). It holds for all CPUs, and
/// costs power.
/// Thread safety: objects are independent; each is used by one thread.
/// Real-time: no; set-up and tear-down only.
class CpuDmaLatency {
 public:
  /// Throws Error when refused and `realtime` is require; with off it does nothing.
  CpuDmaLatency(int latency_us, Realtime realtime);
  ~CpuDmaLatency();
  CpuDmaLatency(const CpuDmaLatency&) = delete;
  CpuDmaLatency& operator=(const CpuDmaLatency&) = delete;

  /// The request that was refused and the reason, or nothing.
  const std::string& refused() const noexcept { return refused_; }

 private:
  int file_ = -1;
  std::string refused_;
};

}  // namespace takt

#endif  // TAKT_SCHED_THREADS_CPU_DMA_LATENCY_HPP_
