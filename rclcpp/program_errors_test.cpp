// What is wrong with the environment: one sentence, and a status that a script sees.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "program_test.hpp"

namespace rclcpp {
namespace {

using ProgramErrorsDeathTest = ProgramDeathTest;
const auto kBadUsage = testing::ExitedWithCode(2);

/// A program that catches nothing. (Google Test would catch it; and behind `noexcept` code that is
/// instrumented for the thread sanitizer terminates without a current exception.)
template <class F>
[[noreturn]] void run_as_most_do(F&& program) {
  try {
    rclcpp::init(0, nullptr);
    program();
    rclcpp::shutdown();
  } catch (...) {
    std::terminate();
  }
  std::exit(0);
}

void spin_a_while() {
  const auto node = std::make_shared<Node>("camera");
  const auto timer = node->create_wall_timer(10ms, [] { rclcpp::shutdown(); });
  rclcpp::spin(node);
}

// Uncaught, it was an abort with a core, and `takt run` said SIGABRT.
TEST_F(ProgramErrorsDeathTest, WhatNobodyCatchesIsASentenceAndAStatus) {
  EXPECT_EXIT(
      {
        setenv("TAKT_EXECUTOR", "event", 1);
        run_as_most_do([] {});
      },
      kBadUsage, "error: TAKT_EXECUTOR: no executor is called 'event'; did you mean 'events'");
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG", "/none/robot.yaml", 1);
        run_as_most_do([] {});
      },
      kBadUsage, "error: /none/robot.yaml:1: the file cannot be read: No such file");
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camara: {}\n");
        run_as_most_do(spin_a_while);
      },
      kBadUsage, "error: .*robot.yaml:2: this program has no node '/camara'");
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camera: {}\n");
        run_as_most_do([] { throw std::runtime_error("its own"); });
      },
      testing::KilledBySignal(SIGABRT), "its own");
}

TEST_F(ProgramErrorsDeathTest, AThreadWithoutItsRightsIsAnErrorWhereTheyAreRequired) {
  const auto without_rights = [] {
    const rlimit none{0, 0};
    if (setrlimit(RLIMIT_RTPRIO, &none) != 0) std::abort();
    if (geteuid() == 0 && setresuid(65534, 65534, 65534) != 0) std::abort();
    spin_a_while();
  };
  const std::string file =
      "threads:\n  urgent: {policy: SCHED_FIFO, priority: 10}\n"
      "executors:\n  fast: {threads: [urgent]}\n"
      "nodes:\n  /camera: {executor: fast}\n";
  EXPECT_EXIT(
      {
        configure("realtime: require\n" + file);
        run_as_most_do(without_rights);
      },
      kBadUsage, "error: .*urgent.*SCHED_FIFO");
  EXPECT_EXIT(
      {
        configure("realtime: prefer\n" + file);
        run_as_most_do(without_rights);
      },
      kEndsWell, "note: SCHED_FIFO 10: Operation not permitted");
}

// Its main thread never spins: the error came at exit, whose status was 0.
TEST_F(ProgramErrorsDeathTest, AProgramMaySpinInThreadsOfItsOwn) {
  const auto spin_in_threads = [] {
    const auto node = std::make_shared<Node>("camera"), other = std::make_shared<Node>("lidar");
    std::atomic<int> calls = 0;
    const auto end = [&](TimerBase& timer) {
      timer.cancel();
      if (++calls == 2) rclcpp::shutdown();
    };
    const auto one = node->create_wall_timer(1ms, end), two = other->create_wall_timer(1ms, end);
    std::thread first([&] { rclcpp::spin(node); }), second([&] { rclcpp::spin(other); });
    first.join();
    second.join();
  };
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camera: {}\n  /lidar: {}\n");
        run_as_most_do(spin_in_threads);
      },
      kEndsWell, "in force");
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camera: {}\n  /lydar: {}\n");
        run_as_most_do(spin_in_threads);
      },
      kBadUsage, "error: .*robot.yaml:3: this program has no node '/lydar'; did you mean '/lidar'");
}

/// Runs it in two processes; the second to end is the one that returns.
[[noreturn]] void run_twice() {
  const pid_t child = fork();
  run_as_most_do([&] {
    spin_a_while();
    if (child == 0) return;
    int status = 0;
    if (waitpid(child, &status, 0) != child || status != 0) std::abort();
  });
}

TEST_F(ProgramErrorsDeathTest, TwoProcessesWithOneFile) {
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camera: {}\n");
        run_twice();
      },
      kEndsWell, "in force");
  std::remove(file().c_str());
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", file().c_str(), 1);
        run_twice();
      },
      kEndsWell, "");
  std::ifstream written(file());
  const std::string results{std::istreambuf_iterator(written), {}};
  EXPECT_NE(results.find("another process has written its results to the same file"),
            std::string::npos)
      << results;
  std::remove(file().c_str());
  // Of the second, which finds the file at its start or its end.
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG_TEMPLATE", file().c_str(), 1);
        run_twice();
      },
      [](int status) { return WIFEXITED(status) && WEXITSTATUS(status) != 0; },
      "error: TAKT_CONFIG_TEMPLATE=.*: the file exists, and is not overwritten");
}

}  // namespace
}  // namespace rclcpp
