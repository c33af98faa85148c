// How long does it take from publish to the start of the callback, in the same thread, another
// thread, another process?
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <unistd.h>

#include "takt/rt_tests/process_pair.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"

using namespace takt;

namespace {

constexpr std::uint64_t kMessages = 200;

Histogram same_thread() {
  const auto executor = rt::executor_on(rt::realtime_thread(80));
  rt::Pair pair(nullptr, 0);
  pair.talk(*executor);
  pair.listen(*executor, kMessages);
  std::thread([&] { executor->spin(); }).join();
  return pair.latency;
}

Histogram other_thread() {
  const auto talking = rt::executor_on(rt::realtime_thread(70)),
             listening = rt::executor_on(rt::realtime_thread(80));
  rt::Pair pair(nullptr, 0);
  pair.listen(*listening, kMessages);
  pair.talk(*talking);
  std::thread talker([&] { talking->spin(); });
  std::thread([&] { listening->spin(); }).join();
  talking->cancel();
  talker.join();
  return pair.latency;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(
      argc, argv,
      "How long does it take from publish to the start of the callback, in the same thread, "
      "another thread, another process? (8 bytes at 2 kHz)");
  test.needs_realtime();
  rt::ProcessPair other({.domain = 20 + getpgrp() % 80});
  const CpuDmaLatency dma_latency(0, Realtime::prefer);
  rt::Rounds same_thread_rounds, other_thread_rounds, other_process_rounds;
  for (int round = 0; round < test.rounds(9); ++round) {
    same_thread_rounds.add(same_thread());
    other_thread_rounds.add(other_thread());
    other_process_rounds.add(other.run(kMessages));
  }
  test.add("same thread", same_thread_rounds.values());
  test.add("other thread", other_thread_rounds.values());
  test.add("other process", other_process_rounds.values());
  test.expect_at_most(1, same_thread_rounds.p50_us, other_thread_rounds.p50_us,
                      "the same thread, without a wake-up, is faster than another thread");
  test.expect_at_most(1, other_thread_rounds.p50_us, other_process_rounds.p50_us,
                      "another thread, by pointer, is faster than another process, by DDS");
  return test.finish();
}
