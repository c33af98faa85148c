// How long do systems of thousands of nodes take to start and to end, and how much memory does a
// node take? Each node has a publisher, a subscription of its neighbour's topic, a timer, and a
// parameter; with parameter services; and with a DDS participant, which brings ROS 2's graph, and
// /rosout. Memory: histograms (`statistics`), all else that was asked for (`objects`), and what
// allocators and pages add. Each measurement runs in a process of its own.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/containers/process_usage.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/parameter_services.hpp"
#include "takt/ros2/rosout.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Small {
  std::array<std::byte, 64> payload{};
};
TAKT_MESSAGE(Small, "bench/msg/Small", payload);

struct Figures {
  double create_ms = 0, spin_ms = 0, end_ms = 0;
  double resident_kb = 0, statistics_kb = 0, objects_kb = 0;  // of a node
};

double resident_kb() {
  return static_cast<double>(proportional_set_size_kb());
}

double allocated_kb() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / 1024;
}

double statistics_kb(const std::vector<CallbackStatistics>& rows) {
  std::size_t bytes = 0;
  for (const CallbackStatistics& row : rows) {
    bytes += sizeof(CallbackTimes);
    if (has_message_times(row.kind)) bytes += sizeof(MessageTimes);
  }
  return static_cast<double>(bytes) / 1024;
}

double ms_since(TimePoint start) {
  return std::chrono::duration<double, std::milli>(Clock::steady().now() - start).count();
}

enum class With { nothing, parameter_services, ros2 };  // ros2: and the graph, and /rosout

Figures measure(std::size_t count, With with) {
  struct Member {
    std::shared_ptr<Node> node;
    std::vector<std::shared_ptr<void>> entities;
    std::unique_ptr<ParameterServices> services;
  };
  Figures figures;
  NodeOptions options;
  if (with == With::ros2) {
    options.participant =
        Participant::create({.domain = 99, .discovery = DiscoveryRange::localhost});
  }
  const auto executor = executors().make("events", {});
  std::vector<Member> members;
  members.reserve(count);
  const auto add = [&](std::size_t i) {
    Member& member = members.emplace_back();
    member.node = std::make_shared<Node>("node_" + std::to_string(members.size()), options);
    member.node->declare_parameter("gain", 1.0);
    member.entities = {member.node->create_publisher<Small>("topic_" + std::to_string(i), 10),
                       member.node->create_subscription<Small>("topic_" + std::to_string(i + 1), 10,
                                                               [](const Small&) {}),
                       member.node->create_timer("timer", 1h, [] {})};
    if (with != With::nothing) {
      member.services = std::make_unique<ParameterServices>(*member.node, *member.node);
    }
    executor->add_node(member.node);
  };
  add(count);  // what comes once only
  const auto rosout = with == With::ros2 ? std::make_unique<Rosout>(*members[0].node) : nullptr;
  const double resident = resident_kb(), allocated = allocated_kb();
  TimePoint start = Clock::steady().now();
  for (std::size_t i = 0; i < count; ++i) add(i);
  figures.create_ms = ms_since(start);
  start = Clock::steady().now();
  std::jthread thread([&] { executor->spin(); });
  while (!executor->is_spinning()) std::this_thread::yield();
  figures.spin_ms = ms_since(start);
  const auto nodes = static_cast<double>(count);
  figures.resident_kb = (resident_kb() - resident) / nodes;
  const double asked_for = (allocated_kb() - allocated) / nodes;
  start = Clock::steady().now();
  executor->cancel();
  thread.join();
  figures.end_ms = ms_since(start);
  figures.statistics_kb =
      statistics_kb(executor->statistics()) / static_cast<double>(members.size());
  figures.objects_kb = asked_for - figures.statistics_kb;
  start = Clock::steady().now();
  members.clear();
  figures.end_ms += ms_since(start);
  return figures;
}

/// In a child process, as memory that was used once stays resident.
Figures measure_apart(std::size_t count, With with) {
  Figures figures;
  int ends[2];
  if (pipe(ends) != 0) return figures;
  if (const pid_t child = fork(); child == 0) {
    figures = measure(count, with);
    const bool is_written = write(ends[1], &figures, sizeof figures) == sizeof figures;
    _exit(is_written ? 0 : 1);
  } else {
    close(ends[1]);
    if (read(ends[0], &figures, sizeof figures) != sizeof figures) figures = {};
    close(ends[0]);
    waitpid(child, nullptr, 0);
  }
  return figures;
}

void nodes(benchmark::State& state, With with) {
  const auto count = static_cast<std::size_t>(state.range(0));
  Figures last;
  for ([[maybe_unused]] auto _ : state) {
    last = measure_apart(count, with);
    state.SetIterationTime((last.create_ms + last.spin_ms) / 1e3);
  }
  state.counters["create_ms"] = last.create_ms;
  state.counters["spin_ms"] = last.spin_ms;
  state.counters["end_ms"] = last.end_ms;
  state.counters["node_kB"] = last.resident_kb;
  state.counters["statistics_kB"] = last.statistics_kb;
  state.counters["objects_kB"] = last.objects_kb;
  state.counters["ratio"] = last.resident_kb / (last.statistics_kb + last.objects_kb);
}
void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(1000)->Arg(5000)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(nodes, bare, With::nothing)->Apply(sizes);
BENCHMARK_CAPTURE(nodes, parameter_services, With::parameter_services)->Apply(sizes);
// A process has 8,100 ends on DDS at most, and such a node 14 of them.
BENCHMARK_CAPTURE(nodes, ros2, With::ros2)
    ->Arg(250)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace takt
