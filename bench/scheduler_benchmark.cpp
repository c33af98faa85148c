// What does a scheduler cost per callback, depending on the number of ready callbacks?
// SPDX-License-Identifier: Apache-2.0
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

void push_and_pop(benchmark::State& state, const std::string& name) {
  const auto count = static_cast<std::size_t>(state.range(0));
  std::vector<CallbackInfo> infos(count);
  std::vector<ReadyCallback> callbacks(count);
  std::minstd_rand random(42);
  for (std::size_t i = 0; i < count; ++i) {
    infos[i].id = infos[i].registration = static_cast<CallbackId>(i);
    infos[i].group = static_cast<GroupId>(i % 10);
    infos[i].priority = static_cast<int>(random() % 100);
    infos[i].kind = static_cast<EntityKind>(random() % 5);
    callbacks[i].info = &infos[i];
  }
  const auto scheduler = schedulers().make(name, {});
  scheduler->configure(infos);
  std::uint64_t sequence = 0;
  const auto push = [&](ReadyCallback& callback) {
    callback.sequence = ++sequence;
    callback.ready_time = TimePoint(Nanoseconds(static_cast<std::int64_t>(sequence)));
    callback.window = sequence / count;
    scheduler->push(callback);
  };
  for (ReadyCallback& callback : callbacks) push(callback);
  for ([[maybe_unused]] const auto iteration : state) {
    ReadyCallback* callback = scheduler->pop();
    benchmark::DoNotOptimize(callback);
    push(*callback);
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const std::string& name : schedulers().names()) {
    benchmark::RegisterBenchmark(("push_and_pop/" + name).c_str(), push_and_pop, name)
        ->Arg(1)
        ->Arg(10)
        ->Arg(100)
        ->Arg(1000);
  }
  return true;
}();

}  // namespace
}  // namespace takt
