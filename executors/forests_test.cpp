// Graphs that branch, on one thread: `chain_edf` and `job_priority` give the schedule of a
// scheduler of graphs that knows whose instance each callback belongs to.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

/// Trees of callbacks: a timer is the root, and each other callback receives what its parent sends
/// at its end.
struct Forest {
  struct Tree {
    Nanoseconds period, phase, deadline;
    int priority;
  };
  struct Callback {
    std::size_t tree;
    std::optional<std::size_t> parent;  // a root has none
    Nanoseconds work;
  };
  std::vector<Tree> trees;
  std::vector<Callback> callbacks;  // a parent before its children

  std::vector<std::size_t> children(std::size_t of) const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < callbacks.size(); ++i) {
      if (callbacks[i].parent == of) result.push_back(i);
    }
    return result;
  }

  static Forest random(unsigned seed) {
    std::mt19937 engine(seed);
    const auto between = [&](int least, int most) {
      return std::uniform_int_distribution(least, most)(engine);
    };
    Forest forest;
    const int trees = between(1, 4);
    for (int i = 0; i < trees; ++i) {
      // Distinct priorities, and no two absolute deadlines are equal.
      forest.trees.push_back({.period = between(20, 200) * 100ns,
                              .phase = between(1, 50) * 100ns,
                              .deadline = between(10, 300) * 100ns + i * 1ns,
                              .priority = 0});
    }
    std::vector<int> priorities(forest.trees.size());
    std::iota(priorities.begin(), priorities.end(), 1);
    std::shuffle(priorities.begin(), priorities.end(), engine);
    for (std::size_t i = 0; i < forest.trees.size(); ++i) forest.trees[i].priority = priorities[i];
    for (std::size_t i = 0; i < forest.trees.size(); ++i) {
      std::vector<std::size_t> own;
      const int callbacks = between(1, 6);
      for (int k = 0; k < callbacks; ++k) {
        const int parent = own.empty() ? 0 : between(0, static_cast<int>(own.size()) - 1);
        forest.callbacks.push_back(
            {.tree = i,
             .parent =
                 own.empty() ? std::nullopt : std::optional(own[static_cast<std::size_t>(parent)]),
             .work = between(1, 12) * 100ns});
        own.push_back(forest.callbacks.size() - 1);
      }
    }
    return forest;
  }
};

/// Which callback began, and when.
using Start = std::pair<std::size_t, Nanoseconds>;
constexpr Nanoseconds kDuration = 60us;

/// The independent scheduler: non-preemptive, each instance of a tree with one priority; inside an
/// instance, what was sent first runs first.
std::vector<Start> scheduled(const Forest& forest, bool by_deadline) {
  struct Ready {
    std::size_t callback;
    Nanoseconds release;
    int sent;
  };
  std::vector<Ready> ready;
  std::vector<Nanoseconds> next;
  for (const Forest::Tree& tree : forest.trees) next.push_back(tree.phase);
  std::vector<Start> starts;
  int sent = 0;
  Nanoseconds now{0};
  const auto key = [&](const Ready& instance) {
    const Forest::Tree& tree = forest.trees[forest.callbacks[instance.callback].tree];
    return std::tuple(by_deadline ? (instance.release + tree.deadline).count() : -tree.priority,
                      instance.release, instance.sent);
  };
  for (;;) {
    for (std::size_t i = 0; i < forest.callbacks.size(); ++i) {
      const Forest::Callback& root = forest.callbacks[i];
      if (root.parent) continue;
      for (; next[root.tree] <= now; next[root.tree] += forest.trees[root.tree].period)
        ready.push_back({i, next[root.tree], 0});
    }
    if (ready.empty()) {
      now = *std::min_element(next.begin(), next.end());
      if (now > kDuration) return starts;
      continue;
    }
    const auto first =
        std::min_element(ready.begin(), ready.end(),
                         [&](const Ready& a, const Ready& b) { return key(a) < key(b); });
    const Ready running = *first;
    ready.erase(first);
    if (now > kDuration) return starts;
    starts.emplace_back(running.callback, now);
    now += forest.callbacks[running.callback].work;
    for (const std::size_t child : forest.children(running.callback))
      ready.push_back({child, running.release, ++sent});
  }
}

class ForestRun {
 public:
  ForestRun(const Forest& forest, const std::string& scheduler) : forest_(forest) {
    const auto executor = executors().make("events", {.scheduler = scheduler, .clock = &clock_});
    for (std::size_t i = 0; i < forest.callbacks.size(); ++i) add(i);
    std::vector<std::shared_ptr<Chain>> chains;
    for (std::size_t i = 0; i < forest.callbacks.size(); ++i) {
      if (forest.children(i).empty()) chains.push_back(chain_to(i));
    }
    executor->add_node(node_);
    const ManualSpin spin(*executor, clock_, 1);
    clock_.advance(kDuration);
  }
  std::vector<Start> starts;

 private:
  static std::string topic(std::size_t callback) { return "t" + std::to_string(callback); }

  void add(std::size_t index) {
    const Forest::Callback& callback = forest_.callbacks[index];
    std::vector<std::shared_ptr<Publisher<Number>>> outputs;
    for (const std::size_t child : forest_.children(index))
      outputs.push_back(node_->create_publisher<Number>(topic(child), 1000));
    const auto body = [this, index, outputs, work = callback.work] {
      starts.emplace_back(index, clock_.now().time_since_epoch());
      clock_.work(work);
      for (const auto& output : outputs) output->publish(Number{});
    };
    if (callback.parent) {
      subscriptions_.push_back(node_->create_subscription<Number>(
          topic(index), 1000, [body](const Number&) { body(); }));
      return;
    }
    const Forest::Tree& tree = forest_.trees[callback.tree];
    timers_.push_back(node_->create_timer(topic(index), tree.period, body));
    timers_.back()->set_parameters({.releases = 1000});
    timers_.back()->release_at(TimePoint(tree.phase));
  }
  std::shared_ptr<Chain> chain_to(std::size_t leaf) {
    std::vector<Chain::Step> path;
    for (std::optional<std::size_t> i = leaf; i; i = forest_.callbacks[*i].parent)
      path.insert(path.begin(), {node_, topic(*i)});
    const Forest::Tree& tree = forest_.trees[forest_.callbacks[leaf].tree];
    return Chain::create(
        {.name = topic(leaf), .priority = tree.priority, .deadline = tree.deadline}, path);
  }

  const Forest& forest_;
  ManualClock clock_;
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<Timer::SharedPtr> timers_;
  std::vector<std::shared_ptr<Subscription<Number>>> subscriptions_;
};

/// 10,000 in `./dev stress`.
unsigned forests() {
  const char* const said = std::getenv("TAKT_RANDOM_FORESTS");
  return said == nullptr ? 200 : static_cast<unsigned>(std::atoi(said));
}

class Forests : public ::testing::TestWithParam<std::string> {};

TEST_P(Forests, RunAsASchedulerOfGraphsSays) {
  std::size_t overtaken = 0;
  for (unsigned seed = 0; seed < forests(); ++seed) {
    const Forest forest = Forest::random(seed);
    const auto expected = scheduled(forest, GetParam() == "chain_edf");
    ASSERT_EQ(ForestRun(forest, GetParam()).starts, expected) << "seed " << seed;
    if (ForestRun(forest, "fifo").starts != expected) ++overtaken;
  }
  EXPECT_GT(overtaken, forests() / 2);  // the schedule says something
}

INSTANTIATE_TEST_SUITE_P(OfGraphs, Forests, ::testing::Values("chain_edf", "job_priority"),
                         [](const auto& suite) { return suite.param; });

}  // namespace
}  // namespace takt::conformance
