// Runs threads that announce and threads that sleep through all interleavings, with announcing
// threads that are preempted for ever.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "takt/testing/explorer.hpp"

#define takt takt_explored
#include "takt/executors/wait_backends/sleepers.hpp"
#undef takt

namespace takt_explored {
namespace {

using detail::Sleepers;

TEST(Sleepers, PostsOnceToEachSleeper) {
  Sleepers sleepers;
  int posts = 0;
  const auto wake = [&] { return sleepers.wake([&] { ++posts; }); };
  EXPECT_FALSE(wake());
  sleepers.begin();
  sleepers.begin();
  EXPECT_EQ(sleepers.idle(), 2U);
  EXPECT_TRUE(wake());
  EXPECT_EQ(sleepers.idle(), 1U);
  EXPECT_TRUE(wake());
  EXPECT_FALSE(wake());
  EXPECT_EQ(posts, 2);
  EXPECT_EQ(sleepers.idle(), 0U);
}

TEST(Sleepers, WakesWhatSleepsAgainAfterATimeout) {
  Sleepers sleepers;
  int posts = 0;
  const auto wake = [&] { return sleepers.wake([&] { ++posts; }); };
  sleepers.begin();
  EXPECT_TRUE(wake());
  sleepers.end(false);  // its time has come, and the post was not there yet
  EXPECT_FALSE(wake());
  sleepers.begin();
  EXPECT_TRUE(wake());
  sleepers.end(true);
  sleepers.begin();
  EXPECT_EQ(sleepers.idle(), 1U);
  sleepers.end(true);  // of the post that was too many
  EXPECT_EQ(sleepers.idle(), 0U);
  EXPECT_EQ(posts, 2);
}

TEST(Sleepers, LeavesTheOthersAsleepWhenOneTakesItsPost) {
  Sleepers sleepers;
  sleepers.begin();
  sleepers.begin();
  EXPECT_TRUE(sleepers.wake([] {}));
  sleepers.end(true);
  EXPECT_EQ(sleepers.idle(), 1U);
}

TEST(Sleepers, LeavesTheOthersWokenWhenOneEndsByItself) {
  Sleepers sleepers;
  sleepers.begin();
  sleepers.begin();
  EXPECT_TRUE(sleepers.wake([] {}));
  sleepers.end(false);
  EXPECT_EQ(sleepers.idle(), 0U);
  sleepers.end(true);
  sleepers.begin();
  EXPECT_EQ(sleepers.idle(), 1U);
}

TEST(Sleepers, PostsForAThreadThatIsPreemptedBeforeItsPost) {
  Sleepers sleepers;
  int posts = 0;
  sleepers.begin();
  sleepers.wake([&] {
    EXPECT_TRUE(sleepers.would_wake());
    EXPECT_TRUE(sleepers.wake([&] { ++posts; }));
  });
  EXPECT_EQ(posts, 1);
  sleepers.wake([&] { ++posts; });
  EXPECT_EQ(posts, 1) << "it has posted";
  EXPECT_FALSE(sleepers.would_wake());
}

TEST(Sleepers, PostsOnceForAThreadThatIsPreempted) {
  Sleepers sleepers;
  int posts = 0;
  sleepers.begin();
  sleepers.wake([&] {
    for (int sleep = 1; sleep <= 3; ++sleep) {
      for (int i = 0; i < 1000; ++i) sleepers.wake([&] { ++posts; });
      EXPECT_LE(posts, 2 * sleep);
      sleepers.end(true);
      sleepers.begin();
    }
  });
}

TEST(Sleepers, SaysTooLateThatItHasPostedForAnother) {
  Sleepers sleepers;
  int posts = 0;
  sleepers.begin();
  sleepers.wake([&] {
    // Meanwhile the thread wakes up, sleeps again, and is woken by another that is preempted.
    sleepers.wake([&] {
      sleepers.end(true);
      sleepers.begin();
      sleepers.wake([&] {});
    });
    EXPECT_TRUE(sleepers.would_wake());
    sleepers.wake([&] { ++posts; });
  });
  EXPECT_EQ(posts, 1);
}

TEST(Sleepers, WakesAllForThreadsThatArePreempted) {
  Sleepers sleepers;
  int posts = 0;
  sleepers.begin();
  sleepers.begin();
  sleepers.begin();
  sleepers.wake([&] { sleepers.wake([&] { sleepers.wake_all([&] { ++posts; }); }); });
  EXPECT_GE(posts, 3);
  posts = 0;
  sleepers.wake_all([&] { ++posts; });
  EXPECT_EQ(posts, 0) << "all have posted";
}

// ---- Threads ----

// What is announced, and a counting semaphore as the wait back ends are.
class Scene {
 public:
  void announce() {
    const int mine = 1 << Explorer::current();
    work_.fetch_or(mine);
    sleepers_.wake([this] {
      posts_.fetch_add(1);
      posts_.notify_all();
    });
    announced_ |= mine;
  }
  // Comes to an end of its time so often.
  void work(int timeouts) {
    for (;;) {
      sleepers_.begin();
      const bool has_taken = work_.load() == 0 && (timeouts-- > 0 ? take() : wait());
      sleepers_.end(has_taken);
      work_.exchange(0);
    }
  }
  bool is_done() const { return (work_.peek() & announced_) == 0; }

 private:
  bool take() {
    int posts = posts_.load();
    while (posts != 0) {
      if (posts_.compare_exchange_weak(posts, posts - 1)) return true;
    }
    return false;
  }
  bool wait() {
    while (!take()) posts_.wait(0);
    return true;
  }

  Sleepers sleepers_;
  std::atomic<int> work_{0};  // a bit for each thread that announces
  std::atomic<int> posts_{0};
  int announced_ = 0;  // those that have
};

// The first thread that has announced is the last one that goes on, `is_frozen`: the others are
// preempted for ever wherever they are.
void explore(std::size_t announcing, std::size_t sleeping, int timeouts, int preemptions,
             bool is_frozen) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  std::unique_ptr<Scene> scene;
  std::size_t lost = 0;
  Explorer explorer;
  const std::size_t schedules = explorer.explore(
      preemptions,
      [&] {
        scene = std::make_unique<Scene>();
        Explorer::Bodies bodies;
        for (std::size_t i = 0; i < announcing; ++i) {
          bodies.emplace_back([&] {
            scene->announce();
            for (std::size_t other = 0; is_frozen && other < announcing; ++other) {
              if (other != Explorer::current()) Explorer::freeze(other);
            }
          });
        }
        for (std::size_t i = 0; i < sleeping; ++i) {
          bodies.emplace_back([&] { scene->work(timeouts); });
        }
        return bodies;
      },
      [&] { lost += scene->is_done() ? 0 : 1; });
  EXPECT_EQ(lost, 0U) << "of " << schedules << " schedules";
  ::testing::Test::RecordProperty("schedules", static_cast<int>(schedules));
}

TEST(SleepersInterleavings, LoseNoAnnouncement) {
  explore(2, 1, 1, 3, false);
}
TEST(SleepersInterleavings, LoseNoAnnouncementToTwo) {
  explore(2, 2, 1, 2, false);
}
TEST(SleepersInterleavings, WaitForNoThreadThatIsPreempted) {
  explore(2, 1, 1, 3, true);
}
TEST(SleepersInterleavings, WaitForNoneOfTwoThreadsThatArePreempted) {
  explore(3, 1, 0, 3, true);
}
TEST(SleepersInterleavings, WaitForNoThreadThatIsPreemptedIfTwoSleep) {
  explore(2, 2, 1, 2, true);
}

}  // namespace
}  // namespace takt_explored
