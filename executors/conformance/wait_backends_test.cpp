// How threads sleep and are woken, for every wait back end.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>

#include <poll.h>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/testing/pipe.hpp"

namespace takt::conformance {
namespace {

class CountingListener final : public ArrivalListener {
 public:
  void announce(const Arrival&) noexcept override { ++announcements; }
  int announcements = 0;
};

class EveryWaitBackend : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    try {
      backend_ = wait_backends().make(GetParam(), 1);
      backend_->prepare();
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
  std::size_t max_workers() const { return wait_backends().traits(GetParam()).max_workers; }
  Watch watch(CountingListener& listener, int fd) {
    return {.fd = fd, .events = POLLIN, .listener = &listener};
  }
  // Looks until the back end has nothing more to report.
  void look() {
    for (int i = 0; i < 3; ++i) backend_->look();
  }
  std::unique_ptr<WaitBackend> backend_;
};

TEST_P(EveryWaitBackend, KeepsEveryPost) {
  backend_->post();
  backend_->post();
  EXPECT_TRUE(backend_->wait(0, kNever));
  EXPECT_TRUE(backend_->wait(0, kNever));
  EXPECT_FALSE(backend_->wait(0, Clock::steady().now()));
}

TEST_P(EveryWaitBackend, EndsAtTheDeadlineAndNotBefore) {
  const TimePoint deadline = Clock::steady().now() + 2ms;
  EXPECT_FALSE(backend_->wait(0, deadline));
  EXPECT_GE(Clock::steady().now(), deadline);
}

TEST_P(EveryWaitBackend, IsWokenByEachPostOfAnotherThread) {
  constexpr int kRounds = 2000;
  std::atomic<int> woken{0};
  std::jthread other([&] {
    for (int round = 0; round < kRounds; ++round) {
      backend_->post();
      if (round % 3 == 0) woken.wait(round);  // until the others have caught up
    }
  });
  while (woken < kRounds) {
    ASSERT_TRUE(backend_->wait(0, kNever));
    ++woken;
    woken.notify_all();
  }
  EXPECT_FALSE(backend_->wait(0, Clock::steady().now()));
}

// Two kicks of the event descriptor may reach one worker.
TEST_P(EveryWaitBackend, LosesNoPostAmongSeveralWorkers) {
  if (max_workers() < 3) GTEST_SKIP() << "serves few workers";
  constexpr std::size_t kWorkers = 3;
  constexpr int kPosts = 3000;
  const auto backend = wait_backends().make(GetParam(), kWorkers);
  std::atomic<int> taken{0};
  std::vector<std::jthread> workers;
  for (std::size_t worker = 0; worker < kWorkers; ++worker) {
    workers.emplace_back([&, worker] {
      for (int i = 0; i < kPosts / static_cast<int>(kWorkers); ++i) {
        EXPECT_TRUE(eventually([&] { return backend->wait(worker, kNever); }));
        ++taken;
        taken.notify_all();
      }
    });
  }
  for (int round = 0; round < kPosts / 2; ++round) {
    backend->post();
    backend->post();
    // Each worker takes its share only, so that the last ones are not always all awake.
    if (round % 50 == 0) {
      for (int seen = taken; seen < 2 * round; seen = taken) taken.wait(seen);
    }
  }
  workers.clear();
  EXPECT_EQ(taken, kPosts);
}

// A worker that looked at a polling point took the kick that was meant for one that slept, and left
// the post: the sleeper slept for ever.
TEST_P(EveryWaitBackend, WhoLooksTakesNoWakeUpFromWhoSleeps) {
  if (max_workers() < 2) GTEST_SKIP() << "serves few workers";
  constexpr int kPosts = 20'000;
  const auto backend = wait_backends().make(GetParam(), 2);
  std::atomic<int> taken{0};
  std::jthread sleeper([&] {
    while (taken < kPosts) {
      if (backend->wait(0, kNever)) ++taken;
    }
  });
  std::jthread looker([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) backend->look();
  });
  for (int posts = 1; posts <= kPosts; ++posts) {
    backend->post();
    ASSERT_TRUE(eventually([&] { return taken == posts; }));
  }
}

TEST_P(EveryWaitBackend, ReportsEventsOfFileDescriptors) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  CountingListener listener;
  backend_->watch(watch(listener, pipe.reader()));
  look();
  EXPECT_EQ(listener.announcements, 0);
  pipe.send("x");
  EXPECT_FALSE(backend_->wait(0, kNever));  // no post: it has announced
  EXPECT_EQ(listener.announcements, 1);
  look();  // still to be read, but no event
  EXPECT_EQ(listener.announcements, 1);
  pipe.receive(1);
  pipe.send("x");
  look();
  EXPECT_EQ(listener.announcements, 2);
  backend_->unwatch(&listener);
  pipe.send("x");
  look();
  EXPECT_EQ(listener.announcements, 2);
}

TEST_P(EveryWaitBackend, ReportsWhatWasReadyBefore) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  pipe.send("x");
  CountingListener listener;
  backend_->watch(watch(listener, pipe.reader()));
  look();
  EXPECT_EQ(listener.announcements, 1);
}

TEST_P(EveryWaitBackend, WatchesOneDescriptorForTwo) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  CountingListener first, second;
  backend_->watch(watch(first, pipe.reader()));
  backend_->watch(watch(second, pipe.reader()));
  pipe.send("x");
  look();
  EXPECT_EQ(first.announcements, 1);
  EXPECT_EQ(second.announcements, 1);
  backend_->unwatch(&first);
  pipe.send("x");
  look();
  EXPECT_EQ(first.announcements, 1);
  EXPECT_EQ(second.announcements, 2);
}

// The user has closed a descriptor too early, and its number was given to another file.
TEST_P(EveryWaitBackend, WhoWatchesAClosedFileDoesNotEndTheWatchOfItsSuccessor) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe successor;
  int number = -1;
  CountingListener early, late;
  {
    Pipe pipe;
    number = pipe.reader();
    backend_->watch(watch(early, number));
    look();
  }
  ASSERT_EQ(dup2(successor.reader(), number), number);
  backend_->watch(watch(late, number));
  backend_->unwatch(&early);
  look();
  const int before = late.announcements;
  successor.send("x");
  look();
  EXPECT_EQ(late.announcements, before + 1);
  backend_->unwatch(&late);
  close(number);
}

TEST_P(EveryWaitBackend, ServesMoreDescriptorsThanFitIntoOneCall) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  constexpr std::size_t kPipes = 200;
  std::vector<Pipe> pipes(kPipes);
  std::vector<CountingListener> listeners(kPipes);
  for (int round = 1; round <= 2; ++round) {
    for (std::size_t i = 0; i < kPipes; ++i) {
      backend_->watch(watch(listeners[i], pipes[i].reader()));
    }
    look();
    for (std::size_t i = 0; i < kPipes; ++i) pipes[i].send("x");
    for (std::size_t i = 0; i < kPipes; ++i) backend_->look();
    for (std::size_t i = 0; i < kPipes; ++i) {
      EXPECT_GE(listeners[i].announcements, round) << i;  // each look may repeat it
      backend_->unwatch(&listeners[i]);
    }
    look();
  }
}

// A wait back end can be waited for by another one, as `isolated` does for its children.
TEST_P(EveryWaitBackend, HasADescriptorThatReportsEvents) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  CountingListener inner, outer;
  backend_->watch(watch(inner, pipe.reader()));
  look();
  const auto parent = wait_backends().make("epoll", 1);
  parent->watch(watch(outer, backend_->fd()));
  parent->look();
  const int before = outer.announcements;
  for (int round = 1; round <= 3; ++round) {
    pipe.send("x");
    EXPECT_FALSE(parent->wait(0, kNever));
    EXPECT_EQ(outer.announcements, before + round);
    look();
    EXPECT_EQ(inner.announcements, round);
  }
}

INSTANTIATE_TEST_SUITE_P(Registered, EveryWaitBackend, ::testing::ValuesIn(wait_backends().names()),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace takt::conformance
