// An executor with nothing to do does nothing: no polling, no helper thread, no periodic wake-up.
// Others: 50 % of a CPU when idle (rclcpp #2799), a wake-up each 50 ms or 100 ms (Agnocast, CIE).
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

using Sleeps = std::map<std::string, long>;

/// How often each thread of this process has gone to sleep so far, but for those named.
Sleeps sleeps(const Sleeps& but = {}) {
  Sleeps sleeps;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    if (but.contains(task.path().filename())) continue;
    std::ifstream status(task.path() / "status");
    for (std::string word; status >> word;) {
      if (word == "voluntary_ctxt_switches:") status >> sleeps[task.path().filename()];
    }
  }
  return sleeps;
}

TEST(Idle, ExecutorThreadsSleepThroughFiveSeconds) {
  struct Idler {
    std::string name;
    std::unique_ptr<Executor> executor;
    std::shared_ptr<Node> node;
    std::shared_ptr<Timer> timer;
    std::shared_ptr<FileDescriptor> reader;
    std::thread thread;
  };
  std::thread([] {}).join();  // makes a sanitizer start its own
  const Sleeps others = sleeps();
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  std::vector<Idler> idlers;
  const auto add = [&](const std::string& name, const std::string& wait) {
    ExecutorOptions options{.name = name + " " + wait, .wait = wait};
    if (wait == "io_uring") options.threads.resize(1);
    Idler idler{
        options.name, executors().make(name, options), std::make_shared<Node>("node"), {}, {}, {}};
    idler.timer = idler.node->create_timer("hourly", 1h, [] {});
    if (wait != "futex") {
      idler.reader = idler.node->create_file_descriptor(
          "pipe", pipe_ends[0], FileDescriptorEvents::readable, [](FileDescriptorEvents) {});
    }
    idler.executor->add_node(idler.node);
    idlers.push_back(std::move(idler));
  };
  for (const std::string& wait : wait_backends().names()) {
    try {
      wait_backends().make(wait, 1);
    } catch (const Error& error) {
      continue;  // this kernel does not grant it
    }
    for (const std::string& name : executors().names()) add(name, wait);
  }
  for (Idler& idler : idlers) idler.thread = std::thread([&] { idler.executor->spin(); });
  // Threads that start wait for each other in the kernel; what counts is what follows.
  Sleeps before = sleeps(others);
  for (int tries = 0; tries < 50; ++tries) {
    std::this_thread::sleep_for(200ms);
    const Sleeps now = sleeps(others);
    if (std::exchange(before, now) == now) break;
  }
  std::this_thread::sleep_for(5s);
  EXPECT_GE(before.size(), idlers.size());
  for (const auto& [task, count] : sleeps(others)) {
    EXPECT_EQ(count, before[task]) << "thread " << task << " woke";
  }
  for (Idler& idler : idlers) {
    idler.executor->cancel();
    idler.thread.join();
  }
  idlers.clear();
  close(pipe_ends[0]);
  close(pipe_ends[1]);
}

}  // namespace
}  // namespace takt
