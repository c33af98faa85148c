// Does anything allocate memory or cause page faults while an executor spins?
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/memory_lock.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

struct Image {
  std::array<std::uint8_t, 100'000> pixels{};
};
TAKT_MESSAGE(Image, "rt_tests/msg/Image", pixels);

/// A timer at 1 kHz that publishes three loaned images for two subscriptions.
ThreadCounters run(const std::string& name, double& callbacks) {
  std::vector<ThreadAttributes> threads(executors().traits(name).pool ? 2 : 1,
                                        rt::realtime_thread(50));
  const auto executor = executors().make(name, {.threads = threads});
  const auto node = std::make_shared<Node>("node");
  const auto publisher = node->create_publisher<Image>("image", 3, {.loans = 16});
  int ticks = 0;
  const auto timer = node->create_timer("tick", 1ms, [&] {
    for (int i = 0; i < 3; ++i) {
      if (auto loan = publisher->borrow_loaned_message()) publisher->publish(std::move(loan));
    }
    if (++ticks == 500) executor->cancel();
  });
  const auto look = node->create_subscription<Image>("image", 3, [](const Image&) {});
  const auto keep =
      node->create_subscription<Image>("image", 3, [](std::shared_ptr<const Image>) {});
  executor->add_node(node);
  std::thread([&] { executor->spin(); }).join();
  for (const CallbackStatistics& callback : executor->statistics()) {
    callbacks += static_cast<double>(callback.received);
  }
  ThreadCounters counters;
  for (const ThreadStatistics& thread : executor->thread_statistics()) counters += thread.counters;
  return counters;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(
      argc, argv,
      "Does anything allocate memory or cause page faults while an executor spins? (from "
      "the start of spin() to its end, 100 KB messages at 3 kHz)");
  const std::string refused = lock_memory(Realtime::prefer);
  if (!refused.empty() || !allocations_are_counted()) {
    fmt::print("skipped: {}\n", refused.empty() ? "allocations are not counted here" : refused);
    return 77;
  }
  for (const std::string& name : executors().names()) {
    double callbacks = 0;
    const ThreadCounters counters = run(name, callbacks);
    test.add(name, {{"callbacks", callbacks},
                    {"allocations", static_cast<double>(counters.allocations)},
                    {"minor_faults", static_cast<double>(counters.minor_faults)},
                    {"major_faults", static_cast<double>(counters.major_faults)}});
    test.expect(counters.allocations == 0, name + ": no allocation");
    test.expect(counters.minor_faults + counters.major_faults == 0, name + ": no page fault");
  }
  return test.finish();
}
