// The calls of the sequences from four threads at once, on an executor that spins. Each thread's
// calls come from a fixed seed; what the threads do to each other is up to the machine, so this is
// for crashes, sanitizers, lost exclusion and callbacks that run when they must not.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdlib>
#include <future>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>

#include "takt/executors/sequences/actor.hpp"
#include "takt/testing/band.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/time_bound.hpp"

namespace takt::sequences::threads {
namespace {

using namespace std::chrono_literals;

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kCallsOfAThread = 150;
#else
constexpr int kCallsOfAThread = 1000;
#endif
constexpr int kThreads = 4, kCallsBefore = 20;
constexpr std::chrono::seconds kLongest{120};  // they take one

// If its group is in the executor, or can be.
void expect_every_change_reported(Common& common) {
  try {
    common.executor->add_callback_group(common.event->group(), common.place.node);
  } catch (const Error&) {
  }
  common.executor->spin_all(1s);
  if (common.event->ready_count() != 0) return;
  const MatchedStatus now = common.publishers[0]->events()->status(MatchedStatus{});
  EXPECT_EQ(common.reported, now.total_count) << "changes that were reported twice, or not";
}

/// A registered name, and what runs has a thread for.
struct Kind {
  std::string type;
  Isolation per = Isolation::node;
};

std::string name_of(const Kind& kind) {
  return kind.type + (kind.per == Isolation::group ? "_per_group" : "");
}

class FourThreads : public testing::TestWithParam<Kind> {
 protected:
  const ExecutorTraits traits_ = executors().traits(GetParam().type);
};

TEST_P(FourThreads, MayCallWhateverOneMay) {
  broken = nullptr;
  const char* const asked = std::getenv("TAKT_THREADS_SEED");
  const unsigned seed = asked != nullptr ? static_cast<unsigned>(std::atoi(asked)) : 0;
  const TimeBound bound(kLongest,
                        fmt::format("FourThreads with seed {}: {}", seed, name_of(GetParam())));
  Logger::instance().set_level(LogLevel::error);  // of goals that nobody ends
  std::vector<std::weak_ptr<Probe>> probes;
  {
    Common common;
    ExecutorOptions options{.per = GetParam().per};
    if (options.per == Isolation::group) options.reentrant_threads = 2;
    if (traits_.takes_band) {
      options.threads = band_of(3);
      options.realtime = Realtime::off;  // else the four may wait for a CPU for long
    } else {
      options.threads.resize(std::min<std::size_t>(traits_.max_threads, 2));
    }
    common.executor = executors().make(GetParam().type, options);
    common.executor->add_node(common.place.node);
    common.executor->add_node(common.managed.node);
    std::vector<std::unique_ptr<Actor>> actors;
    for (unsigned i = 0; i < kThreads; ++i) {
      actors.push_back(std::make_unique<Actor>(common, i, seed + i));
      actors.back()->act(kCallsBefore);
    }
    std::atomic<bool> is_over{false};
    std::thread spinner([&] {
      while (!is_over) common.executor->spin([](const FailedCallback&) { return true; });
    });
    std::vector<std::thread> threads;
    for (const auto& actor : actors) {
      threads.emplace_back([&] { actor->act(kCallsOfAThread), actor->let_go_of_all(); });
    }
    for (std::thread& thread : threads) thread.join();
    is_over = true;
    common.executor->cancel();
    spinner.join();
    for (const auto& actor : actors) {
      probes.insert(probes.end(), actor->probes.begin(), actor->probes.end());
    }
    expect_every_change_reported(common);
    common.executor.reset();
  }
  EXPECT_STREQ(broken.load(), nullptr);
  for (const auto& probe : probes) ASSERT_TRUE(probe.expired());
}

// The handle's owner found that the entity had no executor any more, and did not wait.
TEST_P(FourThreads, ADropWaitsForTheCallbackThatARemovalWaitsForAlready) {
  if (traits_.frozen) GTEST_SKIP() << "it lets nothing go";
  const auto executor = executors().make(GetParam().type, {.per = GetParam().per});
  const auto node = std::make_shared<Node>("node");
  std::promise<void> is_inside, may_leave;
  std::atomic<bool> has_left{false}, has_dropped{false}, was_inside{false};
  auto guard = node->create_guard_condition("guard", [&] {
    is_inside.set_value();
    may_leave.get_future().wait();
    has_left = true;
  });
  const std::shared_ptr<Entity> entity = node->find_entity("guard");
  executor->add_node(node);
  std::thread spinner([&] { executor->spin(); });
  guard->trigger();
  is_inside.get_future().wait();
  std::thread remover([&] { executor->remove_node(node); });
  const auto is_owned = [&] {
    const std::lock_guard lock(ownership_mutex());
    return entity->owner() != nullptr;
  };
  EXPECT_TRUE(eventually([&] { return !is_owned(); }));
  std::thread dropper([&] {
    guard.reset();
    was_inside = !has_left;
    has_dropped = true;
  });
  // Time in which it could show that it does not wait.
  for (int i = 0; i < 100 && !has_dropped; ++i) std::this_thread::yield();
  may_leave.set_value();
  dropper.join();
  remover.join();
  executor->cancel();
  spinner.join();
  EXPECT_FALSE(was_inside);
}

std::vector<Kind> every_executor() {
  std::vector<Kind> kinds;
  for (const std::string& name : executors().names()) {
    kinds.push_back({name});
    if (executors().traits(name).isolates) kinds.push_back({name, Isolation::group});
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(Sequences, FourThreads, testing::ValuesIn(every_executor()),
                         [](const auto& kind) { return name_of(kind.param); });

}  // namespace
}  // namespace takt::sequences::threads
