// How late does a timer callback start under each executor?
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/measuring/cyclic.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"
#include "takt/sched/threads/memory_lock.hpp"

using namespace takt;
using namespace std::chrono_literals;

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  "How late does a timer callback start after its release, under each executor? "
                  "(1 kHz, SCHED_FIFO 80)");
  test.needs_realtime();
  lock_memory(Realtime::prefer);
  const CpuDmaLatency dma_latency(0, Realtime::prefer);
  rt::CyclicOptions options;
  options.thread = rt::realtime_thread(80);
  std::vector<std::unique_ptr<rt::CyclicVariant>> variants;
  variants.push_back(rt::bare_loop(options));
  for (const std::string& name : executors().names()) {
    variants.push_back(rt::executor_timer(options, name));
  }
  variants.push_back(rt::executor_timer(options, "events", 100us));
  const std::atomic<bool> stop{false};
  for (int round = 0; round < test.rounds(15); ++round) {
    for (const auto& variant : variants) variant->round(100, stop);
  }
  const rt::Rounds& bare = variants.front()->result().rounds;
  std::uint64_t early = 0;
  for (const auto& variant : variants) {
    const rt::CyclicResult& result = variant->result();
    early += result.early;
    test.add(result.name, {{"n", static_cast<double>(result.cycles)},
                           {"p50_us", result.rounds.p50()},
                           {"p99_us", result.rounds.p99()},
                           {"max_us", rt::us(result.max)},
                           {"missed", static_cast<double>(result.missed)},
                           {"cpu_%", result.cpu_percent()}});
    if (result.name == "events" || result.name == "static_single_threaded") {
      test.expect_at_most(1.5, result.rounds.p50_us, bare.p50_us,
                          result.name + ": p50 is at most 1.5 times the bare loop's");
      test.expect_at_most(3, result.rounds.p99_us, bare.p99_us,
                          result.name + ": p99 is at most 3 times the bare loop's");
    } else if (&result == &variants.back()->result()) {
      test.expect_at_most(0.2, result.rounds.p50_us, bare.p50_us,
                          result.name + ": p50 is at most a fifth of the bare loop's");
    }
  }
  test.expect(early == 0, fmt::format("none started before its release ({} did)", early));
  return test.finish();
}
