// Tests of what `isolated` has beyond the conformance suite: its threads come and go.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <utility>

#include <sys/eventfd.h>

#include "takt/entities/callback_list.hpp"
#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt::conformance {
namespace {

/// How many threads of this process have names that begin so.
int threads_called(const std::string& prefix) {
  int count = 0;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(thread.path() / "comm");
    std::string name;
    if (std::getline(file, name) && name.starts_with(prefix)) ++count;
  }
  return count;
}

class IsolatedThreads : public testing::TestWithParam<Isolation> {
 protected:
  IsolatedThreads() {
    executor_ = executors().make("isolated", {.per = GetParam()});
    executor_->add_node(stays_);
  }
  static bool has_thread() { return threads_called("goes") != 0; }
  std::shared_ptr<CallbackGroup> make_group() {
    return node_->create_callback_group("group", CallbackGroupType::MutuallyExclusive, false);
  }

  std::unique_ptr<Executor> executor_;
  const std::shared_ptr<Node> stays_ = std::make_shared<Node>("stays");
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("goes");
};

TEST_P(IsolatedThreads, GoWithTheirLastGroup) {
  const auto group = make_group();
  const auto guard = node_->create_guard_condition(
      "guard", [] {}, group);
  const SpinThread spin(*executor_);
  executor_->add_callback_group(group, node_);
  ASSERT_TRUE(eventually(has_thread));
  executor_->remove_callback_group(group, node_);
  EXPECT_TRUE(eventually([] { return !has_thread(); }));  // /proc shows it for a moment after join
}

TEST_P(IsolatedThreads, GoWhenTheirOwnCallbackHasRemovedWhatTheyHad) {
  const auto guard = node_->create_guard_condition("guard", [&] { executor_->remove_node(node_); });
  executor_->add_node(node_);
  const SpinThread spin(*executor_);
  ASSERT_TRUE(eventually(has_thread));
  guard->trigger();
  EXPECT_TRUE(eventually([] { return !has_thread(); }));
  EXPECT_TRUE(eventually([&] { return executor_->is_spinning(); }));
}

// A lifecycle component that makes its group in on_configure and drops it in on_cleanup got one
// thread more each time.
TEST_P(IsolatedThreads, GoWithAGroupThatIsDropped) {
  const SpinThread spin(*executor_);
  ASSERT_TRUE(eventually([&] { return executor_->is_spinning(); }));
  for (int round = 0; round < 5; ++round) {
    auto node = std::make_shared<Node>("goes");
    auto group = node->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
    auto guard = node->create_guard_condition(
        "guard", [] {}, group);
    executor_->add_node(node);
    EXPECT_TRUE(eventually([] { return threads_called("goes") == 1; }));
  }
}

TEST_P(IsolatedThreads, StayAsLongAsThereIsACallbackThoughTheNodeHasGone) {
  int ran = 0;
  auto node = std::make_shared<Node>("goes");
  const auto guard = node->create_guard_condition("guard", [&] { ++ran; });
  executor_->add_node(node);
  node.reset();
  executor_->add_node(node_);
  guard->trigger();
  executor_->spin_all();
  EXPECT_EQ(ran, 1);
}

// The back end of the caller went on watching a child that had been freed, and took the next one,
// at the same address, for that one: nobody heard of its descriptors.
TEST_P(IsolatedThreads, RunOnTheCallerWatchANodeThatIsAddedAgain) {
  std::atomic<int> reads{0};
  const int event = eventfd(0, EFD_NONBLOCK);
  const auto reader =
      node_->create_file_descriptor("event", event, FileDescriptorEvents::readable, [&](auto) {
        eventfd_t count = 0;
        if (eventfd_read(event, &count) == 0) ++reads;
      });
  Promise<int> end;
  std::jthread spinner([&] { executor_->spin_until_future_complete(end.get_future()); });
  const auto stop = [&](void*) { end.set_value(0); };
  const std::unique_ptr<void, decltype(stop)> guard(this, stop);
  for (int round = 0; round < 20; ++round) {
    executor_->add_node(node_);
    for (int i = 1; i <= 10; ++i) {
      ASSERT_EQ(eventfd_write(event, 1), 0);
      EXPECT_TRUE(eventually([&] { return reads == 10 * round + i; })) << round << ", " << i;
    }
    executor_->remove_node(node_);
  }
}

// A thread that asked while a node was removed could hold its child last, whose destructor made a
// pointer to the node: that was the last one, one time of 3,000, so the node ended on that thread.
TEST_P(IsolatedThreads, WhoAsksMeanwhileDestroysNoNode) {
  struct Guest : Node {
    explicit Guest(std::atomic<std::thread::id>& thread) : Node("goes"), ended_on(thread) {}
    ~Guest() override { ended_on.store(std::this_thread::get_id()); }
    std::atomic<std::thread::id>& ended_on;
  };
  const SpinThread spin(*executor_);
  std::vector<std::jthread> asking;
  for (int i = 0; i < 2; ++i) {
    asking.emplace_back([&](const std::stop_token& end) {
      while (!end.stop_requested()) (void)executor_->pending();
    });
  }
  for (int round = 0; round < 1000 / int{kFewerSanitized}; ++round) {
    std::atomic<std::thread::id> ended_on{};
    auto guest = std::make_shared<Guest>(ended_on);
    auto guard = guest->create_guard_condition("guard", [] {});
    executor_->add_node(guest);
    executor_->remove_node(guest);
    guard.reset();
    guest.reset();
    EXPECT_TRUE(eventually([&] { return ended_on.load() != std::thread::id(); }));
    ASSERT_EQ(ended_on.load(), std::this_thread::get_id());
  }
}

// The node's child ended inside the report of the miss, which then locked the child's mutex; only
// sanitizers saw it.
TEST_P(IsolatedThreads, AHandlerOfAMissMayRemoveTheNode) {
  const auto executor = executors().make(
      "isolated", {.per = GetParam(), .watchdog = std::make_shared<Watchdog>(ThreadAttributes{})});
  for (int round = 0; round < 10; ++round) {
    const auto node = std::make_shared<Node>("late");
    const auto timer = node->create_timer("timer", 1ms, [] { std::this_thread::sleep_for(3ms); });
    std::atomic<bool> begins{false}, is_removed{false};
    CallbackParameters parameters;
    parameters.deadline = 1ms;
    parameters.on_deadline_miss = [&](const OverrunReport&) {
      if (begins.exchange(true)) return;
      executor->remove_node(node);
      is_removed = true;
    };
    node->set_callback_parameters({.callback_groups = {}, .callbacks = {{"timer", parameters}}});
    executor->add_node(node);
    const SpinThread spin(*executor);
    EXPECT_TRUE(eventually([&] { return is_removed.load(); }));
  }
}

INSTANTIATE_TEST_SUITE_P(Per, IsolatedThreads, testing::Values(Isolation::node, Isolation::group),
                         [](const auto& per) {
                           return per.param == Isolation::node ? "node" : "group";
                         });

// A function of a list, as a shutdown calls them, removed a node whose callback waited for that
// function: it waited for the end of the node's thread.
TEST_P(IsolatedThreads, AreNotWaitedForByCodeThatTheyWaitFor) {
  std::atomic<bool> is_called{false}, is_over{false};
  detail::CallbackList<void()> list;
  detail::CallbackList<void()>::Entry entry;
  entry = list.add([&] {
    is_called.store(true);
    EXPECT_TRUE(eventually([&] { return entry->is_removed(); }));
    executor_->remove_node(node_);
    is_over.store(true);
  });
  const auto guard = node_->create_guard_condition("guard", [&] {
    EXPECT_TRUE(eventually([&] { return is_called.load(); }));
    entry->remove();
  });
  executor_->add_node(node_);
  const SpinThread spin(*executor_);
  ASSERT_TRUE(eventually([&] { return executor_->is_spinning(); }));
  guard->trigger();
  std::thread caller([&] {
    list.each(detail::CallbackList<void()>::Order::first_added, [](const auto& function) {
      function();
      return true;
    });
  });
  if (!eventually([&] { return is_over.load(); })) std::abort();
  caller.join();
  EXPECT_TRUE(eventually([] { return !has_thread(); }));
}

/// Its handler waits for another thread's call, which removes it.
TEST(Watchdog, AHandlerAndACallThatWaitForEachOtherGoOn) {
  struct Late final : Watchdog::Watched {
    std::optional<TimePoint> report_miss(TimePoint) noexcept override {
      if (calls.fetch_add(1) != 0) return kNever;
      EXPECT_TRUE(eventually([&] { return is_called.load(); }));
      entry->remove();
      return {};
    }
    detail::CallbackList<void()> list;
    detail::CallbackList<void()>::Entry entry;
    std::atomic<bool> is_called{false}, is_removed{false};
    std::atomic<int> calls{0};
  } late;
  Watchdog watchdog({.name = "watchdog"}, Realtime::off);
  late.entry = late.list.add([&] {
    late.is_called.store(true);
    watchdog.remove(late);
    late.is_removed.store(true);
  });
  std::thread caller([&] {
    if (!eventually([&] { return late.calls.load() == 1; })) std::abort();
    late.list.each(detail::CallbackList<void()>::Order::first_added, [](const auto& function) {
      function();
      return true;
    });
  });
  watchdog.add(late);
  if (!eventually([&] { return late.is_removed.load(); })) std::abort();
  caller.join();
}

// The handler was copied after the executor counted as spinning: one whose copy threw left it so.
TEST(IsolatedExecutor, SpinsAgainAfterAHandlerThatCannotBeCopied) {
  struct Fragile {
    Fragile() = default;
    Fragile(const Fragile& other) : copies(other.copies + 1) {
      if (copies > 1) throw std::runtime_error("mine");
    }
    bool operator()(const FailedCallback&) const { return true; }
    int copies = 0;
  };
  const auto executor = executors().make("isolated", {});
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard", [&] { executor->cancel(); });
  executor->add_node(node);
  guard->trigger();
  try {
    executor->spin(Fragile());
  } catch (const std::runtime_error&) {
  }
  executor->spin_some();
}

// ---- Reentrant groups ----

class ReentrantGroups : public testing::Test {
 protected:
  ReentrantGroups() {
    const auto several = node_->create_callback_group("several", CallbackGroupType::Reentrant);
    const auto one = node_->create_callback_group("one", CallbackGroupType::MutuallyExclusive);
    for (const char* name : {"a", "b", "c"}) add_timer(name, several);
    for (const char* name : {"d", "e"}) add_timer(name, one);
  }
  void add_timer(const std::string& name, const std::shared_ptr<CallbackGroup>& group) {
    timers_.push_back(node_->create_timer(
        name, 1s,
        [this, name] {
          const auto start = clock_.now().time_since_epoch();
          clock_.work(4ms);
          const std::lock_guard lock(mutex_);
          starts_.emplace_back(name, start);
        },
        group));
    timers_.back()->release_at(clock_.now() + 1ms);
  }
  /// `threads`: of the child of the reentrant group.
  std::unique_ptr<Executor> spin(std::size_t threads) {
    auto executor = executors().make(
        "isolated", {.per = Isolation::group, .reentrant_threads = threads, .clock = &clock_});
    executor->add_node(node_);
    const ManualSpin spin(*executor, clock_, threads + 2);  // the caller's, and that of `one`
    EXPECT_EQ(executor->thread_count(), threads + 2);
    clock_.advance(50ms);
    return executor;
  }

  ManualClock clock_;
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<Timer::SharedPtr> timers_;
  std::mutex mutex_;
  std::vector<std::pair<std::string, Nanoseconds>> starts_;
};

TEST_F(ReentrantGroups, HaveAsManyThreadsAsTheOptionsSay) {
  const auto executor = spin(2);
  EXPECT_THAT(starts_,
              UnorderedElementsAre(std::pair("a", 1ms), std::pair("b", 1ms), std::pair("c", 5ms),
                                   std::pair("d", 1ms), std::pair("e", 5ms)));
  std::vector<std::string> names;
  for (const auto& thread : executor->thread_statistics()) names.push_back(thread.asked.name);
  EXPECT_THAT(names, ElementsAre("node/several", "node/several-1", "node/one"));
}

TEST_F(ReentrantGroups, HaveOneThreadUnlessTheOptionsSayMore) {
  spin(1);
  EXPECT_THAT(starts_,
              UnorderedElementsAre(std::pair("a", 1ms), std::pair("b", 5ms), std::pair("c", 9ms),
                                   std::pair("d", 1ms), std::pair("e", 5ms)));
}

TEST_F(ReentrantGroups, TheirThreadsAreAsTheGroupSays) {
  node_->set_callback_parameters({.callback_groups = {{"several", {.priority = 70}}}});
  const auto executor =
      executors().make("isolated", {.threads = {{.policy = ThreadPolicy::fifo, .priority = 50}},
                                    .per = Isolation::group,
                                    .reentrant_threads = 3,
                                    .realtime = Realtime::off,
                                    .clock = &clock_});
  executor->add_node(node_);
  { const ManualSpin spin(*executor, clock_, 5); }
  std::vector<int> priorities;
  for (const auto& thread : executor->thread_statistics()) {
    priorities.push_back(thread.asked.priority);
  }
  EXPECT_THAT(priorities, ElementsAre(70, 70, 70, 50));
}

TEST(IsolatedExecutor, SaysWhatReentrantThreadsNeed) {
  const auto error = [](const std::string& type, const ExecutorOptions& options) -> std::string {
    try {
      executors().make(type, options);
    } catch (const Error& refused) {
      return refused.what();
    }
    return "";
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(error("isolated", {.per = Isolation::group, .reentrant_threads = 64}), "");
  EXPECT_THAT(error("isolated", {.per = Isolation::group, .reentrant_threads = 0}),
              HasSubstr("give `reentrant_threads` 1 to 64"));
  EXPECT_THAT(error("isolated", {.per = Isolation::group, .reentrant_threads = 65}),
              HasSubstr("give `reentrant_threads` 1 to 64"));
  EXPECT_THAT(error("isolated", {.reentrant_threads = 2}),
              HasSubstr("leave out `reentrant_threads`, or write `per: group`"));
  EXPECT_THAT(
      error("isolated", {.wait = "io_uring", .per = Isolation::group, .reentrant_threads = 2}),
      HasSubstr("'io_uring' serves one waiting thread"));
  EXPECT_THAT(error("events", {.reentrant_threads = 2}), HasSubstr("or choose 'isolated'"));
}

}  // namespace
}  // namespace takt::conformance
