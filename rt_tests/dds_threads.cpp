// Do messages between processes arrive in time while every CPU is busy, if DDS threads run under
// SCHED_FIFO?
// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/measuring/load.hpp"
#include "takt/rt_tests/process_pair.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"

using namespace takt;

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  "Do messages between processes arrive in time while every CPU is busy? (1 KB at "
                  "2 kHz; executors under SCHED_FIFO, DDS threads under SCHED_FIFO or not)");
  test.needs_realtime();
  constexpr std::uint64_t kMessages = 200;
  constexpr std::size_t kBytes = 1000;
  // One domain for each variant: a process has a set of DDS threads per domain.
  const int domain = 20 + 2 * (getpgrp() % 40);
  rt::ProcessPair placed(
      {.domain = domain, .threads = {.policy = ThreadPolicy::fifo, .priority = 60}}, kBytes);
  rt::ProcessPair unplaced({.domain = domain + 1}, kBytes);
  const CpuDmaLatency dma_latency(0, Realtime::prefer);
  rt::Rounds quiet, busy, busy_unplaced;
  for (int round = 0; round < test.rounds(9); ++round) {
    quiet.add(placed.run(kMessages));
    const rt::Load load("cpu");
    busy.add(placed.run(kMessages));
    busy_unplaced.add(unplaced.run(kMessages));
  }
  test.add("DDS SCHED_FIFO, quiet", quiet.values());
  test.add("DDS SCHED_FIFO, busy", busy.values());
  test.add("DDS SCHED_OTHER, busy", busy_unplaced.values());
  test.expect_at_most(3, busy.p99_us, quiet.p99_us,
                      "DDS SCHED_FIFO: p99 with busy CPUs is at most 3 times that of quiet ones");
  return test.finish();
}
