// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/cpu_dma_latency.hpp"

#include <cerrno>
#include <cstdint>

#include <fcntl.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {

CpuDmaLatency::CpuDmaLatency(int latency_us, Realtime realtime) {
  if (realtime == Realtime::off) return;
  // The kernel holds the request as long as the file is open.
  file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t value = latency_us;
  if (file_ >= 0 && write(file_, &value, sizeof value) == sizeof value) return;
  refused_ = "/dev/cpu_dma_latency: " + errno_message(errno);
  if (file_ >= 0) close(file_);
  file_ = -1;
  if (realtime == Realtime::require) {
    throw Error(refused_, "run as root, or write `realtime: prefer` to go on without");
  }
}

CpuDmaLatency::~CpuDmaLatency() {
  if (file_ >= 0) close(file_);
}

}  // namespace takt
