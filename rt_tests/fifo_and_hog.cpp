// Does a thread's policy protect its callbacks from a hog on the same CPU?
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/measuring/cyclic.hpp"
#include "takt/measuring/load.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

int main(int argc, char** argv) {
  rt::RtTest test(
      argc, argv,
      "How late are callbacks (events, 1 kHz) while a process that never sleeps runs on "
      "each CPU?");
  test.needs_realtime();
  const rt::Load hogs("cpu");
  rt::CyclicOptions fifo, other;
  fifo.thread = rt::realtime_thread(80);
  other.thread.affinity = fifo.thread.affinity;
  const auto under_fifo = rt::executor_timer(fifo, "events");
  const auto under_other = rt::executor_timer(other, "events");
  const std::atomic<bool> stop{false};
  for (int round = 0; round < test.rounds(9); ++round) {
    under_fifo->round(200, stop);
    under_other->round(200, stop);
  }
  for (const auto* variant : {&under_fifo, &under_other}) {
    const rt::CyclicResult& result = (*variant)->result();
    test.add(variant == &under_fifo ? "SCHED_FIFO 80" : "SCHED_OTHER",
             {{"n", static_cast<double>(result.cycles)},
              {"p50_us", result.rounds.p50()},
              {"p99_us", result.rounds.p99()},
              {"missed", static_cast<double>(result.missed)}});
  }
  // No assertion on p99: the kernel's fair scheduler also prefers a thread that slept.
  test.expect_at_most(1, under_fifo->result().rounds.p50_us, under_other->result().rounds.p50_us,
                      "under SCHED_FIFO p50 is less than under SCHED_OTHER");
  return test.finish();
}
