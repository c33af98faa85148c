// Can a component in an endless loop increase the tail latency of another one?
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr Nanoseconds kPeriod = 10ms;
/// Long enough to count as endless: 50 periods, but less than the kernel's throttling permits.
constexpr Nanoseconds kEndless = 500ms;

/// An executor of one thread.
std::unique_ptr<Executor> executor_on(const ThreadAttributes& thread) {
  return executors().make("events", {.threads = {thread}});
}

/// A component whose callback loops on command.
struct Hog {
  Hog(const ThreadAttributes& thread, std::atomic<std::size_t>& looping)
      : executor(executor_on(thread)) {
    loop = node->create_guard_condition("loop", [this, &looping] {
      // Loop until a point in time, so that it ends even if nothing can preempt it.
      const TimePoint end = Clock::steady().now() + kEndless;
      while (Clock::steady().now() < end) {
      }
      --looping;
      executor->cancel();
    });
    executor->add_node(node);
  }

  const std::unique_ptr<Executor> executor;
  const std::shared_ptr<Node> node = std::make_shared<Node>("hog");
  std::shared_ptr<GuardCondition> loop;
};

struct Arrangement {
  std::string name;
  ThreadAttributes hog, victim;
  rt::Rounds rounds;
  std::size_t missed = 0;
};

/// One hog per CPU, and a victim that starts them and measures how late its timer is until they
/// end.
void run_round(rt::RtTest& test, Arrangement& arrangement) {
  std::atomic<std::size_t> looping = available_cpus().size();
  std::vector<std::unique_ptr<Hog>> hogs;
  for (std::size_t i = looping; i > 0; --i) {
    hogs.push_back(std::make_unique<Hog>(arrangement.hog, looping));
  }
  const auto victim = executor_on(arrangement.victim);
  const auto node = std::make_shared<Node>("victim");
  Histogram lateness;
  bool is_first = true;
  const auto timer = node->create_timer("timer", kPeriod, [&] {
    if (std::exchange(is_first, false)) {
      for (const auto& hog : hogs) hog->loop->trigger();
      return;
    }
    lateness.record(Clock::steady().now() - Dispatch::current()->root_release);
    if (looping == 0) victim->cancel();
  });
  timer->cancel();
  // Start the timer when the thread runs, so that its start does not count as latency.
  const auto begin = node->create_guard_condition("begin", [&] { timer->reset(); });
  victim->add_node(node);

  std::vector<Executor*> all{victim.get()};
  for (const auto& hog : hogs) all.push_back(hog->executor.get());
  std::vector<std::thread> threads;
  for (Executor* executor : all) threads.emplace_back([executor] { executor->spin(); });
  begin->trigger();
  for (std::thread& thread : threads) thread.join();
  for (Executor* executor : all) {
    const std::string refused = executor->thread_statistics().at(0).in_force.refused;
    if (!refused.empty()) test.skip(refused);
  }
  arrangement.rounds.add(lateness);
  arrangement.missed += timer->missed();
}

ThreadAttributes reserved(const std::string& name, Nanoseconds runtime, Nanoseconds period) {
  return {.name = name, .policy = ThreadPolicy::deadline, .runtime = runtime, .period = period};
}

/// Without affinity, as required for SCHED_DEADLINE.
ThreadAttributes fifo(const std::string& name, int priority) {
  return {.name = name, .policy = ThreadPolicy::fifo, .priority = priority};
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  fmt::format("How late is a timer of {} ms (events) while one component per CPU "
                              "loops for {} ms?",
                              kPeriod / 1ms, kEndless / 1ms));
  Arrangement with{.name = "SCHED_DEADLINE 1ms/10ms, loops 30ms/100ms",
                   .hog = reserved("hog", 30ms, 100ms),
                   .victim = reserved("victim", 1ms, kPeriod)};
  Arrangement without{
      .name = "SCHED_FIFO 50, loops 60", .hog = fifo("hog", 60), .victim = fifo("victim", 50)};
  for (int round = 0; round < test.rounds(9); ++round) {
    run_round(test, with);
    run_round(test, without);
  }
  for (const Arrangement* arrangement : {&with, &without}) {
    auto values = arrangement->rounds.values();
    values.emplace_back("missed", static_cast<double>(arrangement->missed));
    test.add(arrangement->name, values);
  }
  test.expect_at_most(0.2, with.rounds.p99_us, without.rounds.p99_us,
                      "with reservations p99 is at most a fifth");
  return test.finish();
}
