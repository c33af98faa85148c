// What is the end-to-end latency of an urgent chain while less urgent chains run?
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr int kInstances = 20;
constexpr Nanoseconds kWork = 200us;

struct Step {
  std::int64_t number = 0;
};
TAKT_MESSAGE(Step, "rt_tests/msg/Step", number);

/// A timer and three subscriptions in separate nodes: 0.8 ms of work per instance.
class Chain {
 public:
  Chain(const std::string& name, Nanoseconds period, int priority) {
    for (int i = 0; i < 4; ++i) {
      nodes_.push_back(std::make_shared<Node>(fmt::format("{}_{}", name, i)));
      // PiCAS: priorities increase along the chain.
      groups_.push_back(
          nodes_[i]->create_callback_group("own", CallbackGroupType::MutuallyExclusive));
      groups_[i]->set_parameters({.priority = priority + i});
      if (i < 3) {
        publishers_.push_back(nodes_[i]->create_publisher<Step>(fmt::format("/{}_{}", name, i), 1));
      }
    }
    timer_ = nodes_[0]->create_timer(
        "tick", period, [this] { work(0); }, groups_[0]);
    for (int i = 1; i < 4; ++i) {
      subscriptions_.push_back(nodes_[i]->create_subscription<Step>(
          fmt::format("/{}_{}", name, i - 1), 1, [this, i](const Step&) { work(i); }, groups_[i]));
    }
  }
  void add_to(Executor& executor, std::function<void()> at_end) {
    at_end_ = std::move(at_end);
    for (const auto& node : nodes_) executor.add_node(node);
  }
  Histogram latency;  // release of the timer → end of the last callback

 private:
  void work(int step) {
    rt::burn(kWork);
    if (step < 3) return publishers_[step]->publish(Step{});
    latency.record(Clock::steady().now() - Dispatch::current()->root_release);
    if (at_end_) at_end_();
  }

  std::vector<std::shared_ptr<Node>> nodes_;
  std::vector<std::shared_ptr<CallbackGroup>> groups_;
  std::vector<std::shared_ptr<Publisher<Step>>> publishers_;
  std::vector<std::shared_ptr<Subscription<Step>>> subscriptions_;
  std::shared_ptr<Timer> timer_;
  std::function<void()> at_end_;
};

/// The urgent chain at 100 Hz and four others; together they use four fifths of the CPU.
Histogram urgent_chain(const std::string& name) {
  Chain urgent("urgent", 10ms, 90);
  Chain a("a", 5ms, 10), b("b", 5ms, 10), c("c", 5ms, 10), d("d", 5ms, 10);
  std::vector<ThreadAttributes> threads(1, rt::realtime_thread(50));
  const auto executor = executors().make(name, {.threads = threads});
  for (Chain* chain : {&a, &b, &c, &d}) chain->add_to(*executor, {});
  urgent.add_to(*executor, [&] {
    if (urgent.latency.count() == kInstances) executor->cancel();
  });
  std::thread([&] { executor->spin(); }).join();
  return urgent.latency;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  "How long does an urgent chain of four callbacks (0.8 ms of work, 100 Hz) take "
                  "while four others (0.8 ms, 200 Hz) run on the same CPU?");
  test.needs_realtime();
  std::vector<rt::Rounds> rounds(executors().names().size());
  for (int round = 0; round < test.rounds(3); ++round) {
    for (std::size_t i = 0; i < rounds.size(); ++i) {
      rounds[i].add(urgent_chain(executors().names()[i]));
    }
  }
  std::vector<double> chain_aware, single_threaded;
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    const std::string name = executors().names()[i];
    test.add(name, rounds[i].values());
    if (name == "chain_aware") chain_aware = rounds[i].p50_us;
    if (name == "single_threaded") single_threaded = rounds[i].p50_us;
  }
  test.expect_at_most(0.7, chain_aware, single_threaded,
                      "chain_aware, which uses priorities, takes at most 0.7 of single_threaded, "
                      "which does not");
  return test.finish();
}
