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
  const rt::CyclicResult& bare = variants.front()->result();
  const double bare_p50 = bare.rounds.p50(), bare_p99 = bare.rounds.p99();
  std::uint64_t early = 0;
  for (const auto& variant : variants) {
    const rt::CyclicResult& result = variant->result();
    const double p50 = result.rounds.p50(), p99 = result.rounds.p99();
    early += result.early;
    test.add(result.name, {{"n", static_cast<double>(result.cycles)},
                           {"p50_us", p50},
                           {"p99_us", p99},
                           {"max_us", rt::us(result.max)},
                           {"missed", static_cast<double>(result.missed)},
                           {"cpu_%", result.cpu_percent()}});
    if (result.name == "events" || result.name == "static_single_threaded") {
      test.expect(p50 <= 1.5 * bare_p50,
                  fmt::format("{}: p50 within 1.5 of the bare loop's ({:.2f})", result.name,
                              p50 / bare_p50));
      test.expect(p99 <= 3 * bare_p99, fmt::format("{}: p99 within 3 of the bare loop's ({:.2f})",
                                                   result.name, p99 / bare_p99));
    } else if (&result == &variants.back()->result()) {
      test.expect(p50 <= bare_p50 / 5, fmt::format("{}: p50 at most a fifth of the bare loop's "
                                                   "({:.3f})",
                                                   result.name, p50 / bare_p50));
    }
  }
  test.expect(early == 0, fmt::format("none started before its release ({} did)", early));
  return test.finish();
}
