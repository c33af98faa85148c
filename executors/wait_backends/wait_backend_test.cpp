// Which wait back ends may be chosen. What all must do: conformance/wait_backends_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/wait_backend.hpp"

#include <cerrno>
#include <cstddef>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/testing/pipe.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Events = FileDescriptorEvents;

// ---- Choices ----

class Choice : public testing::Test {
 protected:
  std::shared_ptr<FileDescriptor> add_reader(const std::string& name = "reader") {
    return node_->create_file_descriptor(name, pipe_.reader(), Events::readable, [](Events) {});
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
      node->create_file_descriptor("reader", pipe_.reader(), Events::readable, [](Events) {});
  second->add_node(node);
  second->spin_some();
  EXPECT_NO_THROW((void)node->create_file_descriptor("another", pipe_.reader(), Events::readable,
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
    struct Listener final : ArrivalListener {
      void announce(const Arrival&) noexcept override { ++announcements; }
      int announcements = 0;
    } listener;
    backend->watch({.fd = pipe.reader(), .events = POLLIN, .listener = &listener});
    pipe.send("x");
    backend->wait(0, kNever);
    EXPECT_EQ(listener.announcements, 1);
    backend->unwatch(&listener);
  })
      .join();
}

}  // namespace
}  // namespace takt
