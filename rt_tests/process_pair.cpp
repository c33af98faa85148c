// SPDX-License-Identifier: Apache-2.0
#include "takt/rt_tests/process_pair.hpp"

#include <csignal>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "takt/rt_tests/rt_test.hpp"

namespace takt::rt {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 500us;

std::int64_t now_ns() {
  return Clock::steady().now().time_since_epoch().count();
}

}  // namespace

Pair::Pair(std::shared_ptr<Participant> participant, std::size_t payload_bytes)
    : stamp_{0, std::vector<std::uint8_t>(payload_bytes)} {
  NodeOptions options;
  options.participant = std::move(participant);
  talker_ = std::make_shared<Node>("talker", options);
  listener_ = std::make_shared<Node>("listener", options);
  publisher = talker_->create_publisher<Stamp>(
      "/rt_tests/stamp", 10, {.loans = 16, .prototype = std::make_shared<const Stamp>(stamp_)});
}

void Pair::talk(Executor& executor) {
  timer_ = talker_->create_timer("tick", kPeriod, [this] {
    stamp_.sent_ns = now_ns();
    publisher->publish(stamp_);
  });
  executor.add_node(talker_);
}

void Pair::listen(Executor& executor, std::uint64_t messages) {
  subscription_ = listener_->create_subscription<Stamp>(
      "/rt_tests/stamp", 10, [this, &executor, messages](const Stamp& stamp) {
        latency.record(Nanoseconds(now_ns() - stamp.sent_ns));
        if (latency.count() == messages) executor.cancel();
      });
  executor.add_node(listener_);
}

std::unique_ptr<Executor> executor_on(const ThreadAttributes& thread) {
  return executors().make("events", {.threads = {thread}});
}

ProcessPair::ProcessPair(const DdsOptions& dds, std::size_t payload_bytes)
    : dds_(dds), payload_bytes_(payload_bytes) {
  if (pipe(pipe_.data()) != 0) throw Error("cannot create a pipe");
  child_ = fork();
  if (child_ != 0) return;
  const auto participant = Participant::create(dds);
  for (char byte; read(pipe_[0], &byte, 1) == 1 && byte == 'x';) {
    const auto executor = executor_on(realtime_thread(70));
    Pair pair(participant, payload_bytes);
    while (pair.publisher->subscription_count() == 0) std::this_thread::sleep_for(1ms);
    pair.talk(*executor);
    std::thread spin([&] { executor->spin(); });
    while (pair.publisher->subscription_count() != 0) std::this_thread::sleep_for(1ms);
    executor->cancel();
    spin.join();
  }
  _exit(0);
}

ProcessPair::~ProcessPair() {
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

Histogram ProcessPair::run(std::uint64_t messages) {
  if (participant_ == nullptr) participant_ = Participant::create(dds_);
  const auto executor = executor_on(realtime_thread(80));
  Pair pair(participant_, payload_bytes_);
  pair.listen(*executor, messages);
  if (write(pipe_[1], "x", 1) != 1) throw Error("the child process has ended");
  std::thread([&] { executor->spin(); }).join();
  return pair.latency;
}

}  // namespace takt::rt
