// What does it cost to wake up a thread with each wait back end? Two threads wake each other in
// turn; the result is the time of one wake-up, from post to the return of wait.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <semaphore>
#include <thread>

#include <benchmark/benchmark.h>

#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {
namespace {

constexpr int kWakeUps = 1000;

void post_and_wait(benchmark::State& state, const std::string& name) {
  std::unique_ptr<WaitBackend> here, there;
  try {
    here = wait_backends().make(name, 1);
    there = wait_backends().make(name, 1);
  } catch (const Error& error) {
    return state.SkipWithError(error.what());
  }
  std::atomic<bool> stop{false};
  std::binary_semaphore ready{0};
  std::jthread other([&] {
    there->prepare();
    there->enter(0, {});
    ready.release();
    for (;;) {
      while (!there->wait(0, kNever)) {
      }
      if (stop.load()) break;
      here->post();
    }
    there->leave(0);
  });
  ready.acquire();
  here->prepare();
  here->enter(0, {});
  while (state.KeepRunningBatch(2 * kWakeUps)) {
    for (int i = 0; i < kWakeUps; ++i) {
      there->post();
      while (!here->wait(0, kNever)) {
      }
    }
  }
  here->leave(0);
  stop = true;
  there->post();
}

[[maybe_unused]] const bool registered = [] {
  for (const std::string& name : wait_backends().names()) {
    benchmark::RegisterBenchmark(("post_and_wait/" + name).c_str(), post_and_wait, name)
        ->UseRealTime();
  }
  return true;
}();

}  // namespace
}  // namespace takt
