// Tests of how threads sleep and are woken, for every wait back end; and of which may be chosen.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/wait_backend.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/testing/eventually.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Events = FileDescriptorEvents;

class CountingListener final : public ArrivalListener {
 public:
  void announce(const Arrival&) noexcept override { ++announcements; }
  int announcements = 0;
};

struct Pipe {
  Pipe() { EXPECT_EQ(pipe2(ends, O_NONBLOCK | O_CLOEXEC), 0); }
  ~Pipe() {
    close(ends[0]);
    close(ends[1]);
  }
  void send() const { EXPECT_EQ(write(ends[1], "x", 1), 1); }
  void receive() const {
    char byte = 0;
    EXPECT_EQ(read(ends[0], &byte, 1), 1);
  }
  int ends[2];
};

class EveryWaitBackend : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    try {
      backend_ = wait_backends().make(GetParam(), 1);
      backend_->prepare();
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
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
  if (GetParam() == "io_uring") GTEST_SKIP() << "serves one worker";
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
  if (GetParam() == "io_uring") GTEST_SKIP() << "serves one worker";
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
  backend_->watch(watch(listener, pipe.ends[0]));
  look();
  EXPECT_EQ(listener.announcements, 0);
  pipe.send();
  EXPECT_FALSE(backend_->wait(0, kNever));  // no post: it has announced
  EXPECT_EQ(listener.announcements, 1);
  look();  // still to be read, but no event
  EXPECT_EQ(listener.announcements, 1);
  pipe.receive();
  pipe.send();
  look();
  EXPECT_EQ(listener.announcements, 2);
  backend_->unwatch(&listener);
  pipe.send();
  look();
  EXPECT_EQ(listener.announcements, 2);
}

TEST_P(EveryWaitBackend, ReportsWhatWasReadyBefore) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  pipe.send();
  CountingListener listener;
  backend_->watch(watch(listener, pipe.ends[0]));
  look();
  EXPECT_EQ(listener.announcements, 1);
}

TEST_P(EveryWaitBackend, WatchesOneDescriptorForTwo) {
  if (!backend_->serves_file_descriptors()) GTEST_SKIP() << "serves none";
  Pipe pipe;
  CountingListener first, second;
  backend_->watch(watch(first, pipe.ends[0]));
  backend_->watch(watch(second, pipe.ends[0]));
  pipe.send();
  look();
  EXPECT_EQ(first.announcements, 1);
  EXPECT_EQ(second.announcements, 1);
  backend_->unwatch(&first);
  pipe.send();
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
    number = pipe.ends[0];
    backend_->watch(watch(early, number));
    look();
  }
  ASSERT_EQ(dup2(successor.ends[0], number), number);
  backend_->watch(watch(late, number));
  backend_->unwatch(&early);
  look();
  const int before = late.announcements;
  successor.send();
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
      backend_->watch(watch(listeners[i], pipes[i].ends[0]));
    }
    look();
    for (std::size_t i = 0; i < kPipes; ++i) pipes[i].send();
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
  backend_->watch(watch(inner, pipe.ends[0]));
  look();
  const auto parent = wait_backends().make("epoll", 1);
  parent->watch(watch(outer, backend_->fd()));
  parent->look();
  const int before = outer.announcements;
  for (int round = 1; round <= 3; ++round) {
    pipe.send();
    EXPECT_FALSE(parent->wait(0, kNever));
    EXPECT_EQ(outer.announcements, before + round);
    look();
    EXPECT_EQ(inner.announcements, round);
  }
}

INSTANTIATE_TEST_SUITE_P(Registered, EveryWaitBackend, testing::ValuesIn(wait_backends().names()),
                         [](const auto& name) { return name.param; });

// ---- Choices ----

class Choice : public testing::Test {
 protected:
  std::shared_ptr<FileDescriptor> add_reader(const std::string& name = "reader") {
    return node_->create_file_descriptor(name, pipe_.ends[0], Events::readable, [](Events) {});
  }
  std::unique_ptr<Executor> make(const std::string& name, const ExecutorOptions& options) {
    return executors().make(name, options);
  }
  Pipe pipe_;
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
};

TEST_F(Choice, UnknownNamesAreAnErrorWithTheValidOnes) {
  EXPECT_THAT([&] { make("events", {.wait = "epol"}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("no wait back end is called 'epol'"),
                                         HasSubstr("did you mean 'epoll'?"))));
}

TEST_F(Choice, FutexRefusesFileDescriptors) {
  const auto executor = make("events", {.name = "fast", .wait = "futex"});
  const auto reader = add_reader();
  EXPECT_THAT([&] { executor->add_node(node_); },
              ThrowsMessage<Error>("executor 'fast' waits by 'futex', which cannot serve file "
                                   "descriptor 'reader'; choose `wait: epoll`, or leave it out"));
  // Nothing was changed: another executor can have the node.
  const auto other = make("events", {.wait = "epoll"});
  EXPECT_NO_THROW(other->add_node(node_));
}

TEST_F(Choice, AutoIsFixedAtTheFirstSpin) {
  const auto executor = make("events", {.name = "fast"});
  executor->add_node(node_);
  executor->spin_some();
  EXPECT_THAT([&] { add_reader(); },
              ThrowsMessage<Error>(HasSubstr("add the first one before the first spin")));
  const auto second = make("events", {});
  const auto node = std::make_shared<Node>("other");
  const auto reader =
      node->create_file_descriptor("reader", pipe_.ends[0], Events::readable, [](Events) {});
  second->add_node(node);
  second->spin_some();
  EXPECT_NO_THROW((void)node->create_file_descriptor("another", pipe_.ends[0], Events::readable,
                                                     [](Events) {}));
}

TEST_F(Choice, IoUringRefusesPools) {
  ExecutorOptions options{.wait = "io_uring"};
  options.threads.resize(3);
  EXPECT_THAT([&] { make("multi_threaded", options); },
              ThrowsMessage<Error>("'io_uring' serves one waiting thread, this executor has 3; "
                                   "choose 'epoll', or an executor of one thread"));
}

TEST_F(Choice, AManualClockHasItsOwn) {
  ManualClock clock;
  for (const std::string& executor : executors().names()) {
    for (const std::string& wait : wait_backends().names()) {
      EXPECT_THAT([&] { make(executor, {.wait = wait, .clock = &clock}); },
                  ThrowsMessage<Error>(HasSubstr("cannot wait for a manual clock; leave `wait` "
                                                 "out")))
          << executor;
    }
  }
}

// The kernel, or a sandbox, knows no epoll_pwait2: the thread took a whole CPU.
TEST(Epoll, SleepsWhereEpollPwait2IsRefused) {
  std::thread([] {  // a filter holds for its thread until that ends
    sock_filter code[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_epoll_pwait2, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    sock_fprog filter{std::size(code), code};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0) {
      GTEST_SKIP() << "no seccomp here";
    }
    const auto backend = wait_backends().make("epoll", 1);
    backend->prepare();
    const Nanoseconds cpu_time = thread_cpu_time();
    const TimePoint begin = Clock::steady().now();
    EXPECT_FALSE(backend->wait(0, begin + 200ms));
    const Nanoseconds waited = Clock::steady().now() - begin;
    EXPECT_GE(waited, 200ms);
    EXPECT_LT(thread_cpu_time() - cpu_time, waited / 4);
    const Pipe pipe;
    CountingListener listener;
    backend->watch({.fd = pipe.ends[0], .events = POLLIN, .listener = &listener});
    pipe.send();
    backend->wait(0, kNever);
    EXPECT_EQ(listener.announcements, 1);
    backend->unwatch(&listener);
  })
      .join();
}

}  // namespace
}  // namespace takt
