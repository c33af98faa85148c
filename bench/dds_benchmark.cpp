// What does Takt add to Cyclone DDS between two processes?
// `latency`: time from publish in one process to the callback in the other, and the CPU time of
// both processes per message. It is compared with a bare program that uses Cyclone's C API and
// reads the message in a listener; rounds of both alternate. Sender and receiver run on different
// CPUs. As on a robot, Cyclone's threads have SCHED_FIFO and Takt's executors a higher priority, if
// permitted. `service`: round trip of a service call, compared with a ping-pong of topics,
// alternating.
// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <semaphore>
#include <thread>

#include <benchmark/benchmark.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/histogram.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"
#include "takt/nodes/node.hpp"
#include "takt/transport/dds/cyclone_type.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Parcel {
  std::int64_t sent_ns = 0;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(Parcel, "bench/msg/DdsParcel", sent_ns, data);

struct Echo {
  struct Request {
    std::int64_t value = 0;
  };
  struct Response {
    std::int64_t value = 0;
  };
};
TAKT_MESSAGE(Echo::Request, "bench/srv/Echo_Request", value);
TAKT_MESSAGE(Echo::Response, "bench/srv/Echo_Response", value);

constexpr int kDomain = 97;
constexpr int kRounds = 10, kMessages = 100;

std::int64_t now_ns() {
  return Clock::steady().now().time_since_epoch().count();
}

std::int64_t cpu_time_ns() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ns = [](const timeval& time) {
    return time.tv_sec * 1'000'000'000 + time.tv_usec * 1'000;
  };
  return ns(usage.ru_utime) + ns(usage.ru_stime);
}

/// Data that the two processes exchange in shared memory.
struct Shared {
  enum class Task : int { none, bare, takt, end };
  std::atomic<Task> task{Task::none};
  std::atomic<std::size_t> size_bytes{0};
  std::atomic<std::int64_t> cpu_time_ns{0};  // of the child, for the last task
};
Shared* shared = nullptr;

template <class Condition>
void wait_until(Condition&& condition) {
  while (!condition()) std::this_thread::sleep_for(1ms);
}

ThreadAttributes fifo(int priority) {
  return {.policy = ThreadPolicy::fifo, .priority = priority};
}
constexpr int kDdsPriority = 40, kExecutorPriority = 50;

std::shared_ptr<Node> make_node() {
  NodeOptions options;
  options.participant = Participant::create({.domain = kDomain, .threads = fifo(kDdsPriority)});
  return std::make_shared<Node>("node", options);
}

std::unique_ptr<Executor> make_executor(const std::shared_ptr<Node>& node) {
  ExecutorOptions options;
  options.threads = {fifo(kExecutorPriority)};
  auto executor = executors().make("events", options);
  executor->add_node(node);
  return executor;
}

/// A participant with a topic, a writer and a reader of Cyclone's C API.
struct Bare {
  Bare() {
    ddsi_sertype* used = new Sertype(message_type<Parcel>(), false);
    std::jthread([this] {  // Cyclone's threads inherit
      apply(fifo(kDdsPriority), Realtime::prefer);
      participant = dds_create_participant(kDomain, nullptr, nullptr);
    })
        .join();
    topic = dds_create_topic_sertype(participant, "rt/bare", &used, nullptr, nullptr, nullptr);
    type = static_cast<const Sertype*>(used);
    qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
  }
  ~Bare() { dds_delete(participant), dds_delete_qos(qos); }
  dds_entity_t participant, topic;
  const Sertype* type;
  dds_qos_t* qos;
};

// ---- The peer process: publishes on command, and responds ----

void child() {
  rt::stay_on(0);
  const auto node = make_node();
  const auto publisher = node->create_publisher<Parcel>("takt", 100, {.loans = 100});
  const auto pong = node->create_publisher<Parcel>("pong", 10, {.loans = 10});
  const auto ping = node->create_subscription<Parcel>("ping", 10, [&](const Parcel& parcel) {
    auto answer = pong->borrow_loaned_message();
    answer->sent_ns = parcel.sent_ns;
    pong->publish(std::move(answer));
  });
  const auto service = node->create_service<Echo>(
      "echo", [](const Echo::Request& request, Echo::Response& response) {
        response.value = request.value;
      });
  const auto executor = make_executor(node);
  std::jthread spinner([&] { executor->spin(); });
  const Bare bare;
  const dds_entity_t writer = dds_create_writer(bare.participant, bare.topic, bare.qos, nullptr);

  for (Shared::Task task; (task = shared->task.load()) != Shared::Task::end;) {
    if (task == Shared::Task::none) {
      std::this_thread::sleep_for(1ms);
      continue;
    }
    const std::int64_t cpu_before = cpu_time_ns();
    // Wait until both sides have discovered each other: earlier messages would be lost.
    wait_until([&] {
      dds_publication_matched_status_t status{};
      dds_get_publication_matched_status(writer, &status);
      return status.current_count != 0 && publisher->subscription_count() != 0;
    });
    Parcel own;
    own.data.resize(shared->size_bytes.load());
    for (int i = 0; i < kMessages; ++i) {
      std::this_thread::sleep_for(2ms);
      if (task == Shared::Task::bare) {
        own.sent_ns = now_ns();
        dds_writecdr(writer, encode(*bare.type, &own));
      } else {
        auto loan = publisher->borrow_loaned_message();
        loan->data.resize(own.data.size());
        loan->sent_ns = now_ns();
        publisher->publish(std::move(loan));
      }
    }
    shared->cpu_time_ns.store(cpu_time_ns() - cpu_before);
    shared->task.store(Shared::Task::none);
  }
  executor->cancel();
}

// ---- This process ----

double us(const Histogram& histogram, double fraction) {
  return static_cast<double>(histogram.percentile(fraction).count()) / 1e3;
}

void report(benchmark::State& state, const Histogram& bare_latency, const Histogram& takt_latency,
            const std::array<std::int64_t, 2>& cpu_ns) {
  const auto cpu_us = [&](std::size_t which) {
    return static_cast<double>(cpu_ns[which]) / 1e3 / (kRounds * kMessages);
  };
  state.counters["bare_p50_us"] = us(bare_latency, 0.5);
  state.counters["takt_p50_us"] = us(takt_latency, 0.5);
  state.counters["bare_p99_us"] = us(bare_latency, 0.99);
  state.counters["takt_p99_us"] = us(takt_latency, 0.99);
  state.counters["p50_ratio"] = us(takt_latency, 0.5) / us(bare_latency, 0.5);
  state.counters["bare_cpu_us"] = cpu_us(0);
  state.counters["takt_cpu_us"] = cpu_us(1);
  state.counters["cpu_ratio"] = cpu_us(1) / cpu_us(0);
}

void latency(benchmark::State& state) {
  Histogram bare_latency, takt_latency;
  std::atomic<int> arrived{0};

  const auto node = make_node();
  const auto subscription =
      node->create_subscription<Parcel>("takt", 100, [&](const Parcel& parcel) {
        takt_latency.record(Nanoseconds(now_ns() - parcel.sent_ns));
        arrived.fetch_add(1);
      });
  const auto executor = make_executor(node);
  std::jthread spinner([&] { executor->spin(); });

  const Bare bare;
  struct Received {
    Histogram& latency;
    std::atomic<int>& arrived;
    Parcel parcel{};
  } received{bare_latency, arrived};
  dds_listener_t* listener = dds_create_listener(&received);
  dds_lset_data_available(listener, [](dds_entity_t reader, void* argument) {
    auto& to = *static_cast<Received*>(argument);
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    while (dds_takecdr(reader, &sample, 1, &info, DDS_ANY_STATE) == 1) {
      if (info.valid_data) {
        message_type<Parcel>().decode(static_cast<Serdata*>(sample)->bytes(), &to.parcel);
        to.latency.record(Nanoseconds(now_ns() - to.parcel.sent_ns));
        to.arrived.fetch_add(1);
      }
      ddsi_serdata_unref(sample);
    }
  });
  const dds_entity_t reader = dds_create_reader(bare.participant, bare.topic, bare.qos, listener);
  wait_until([&] {
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(reader, &status);
    return status.current_count != 0 && subscription->outside_publisher_count() != 0;
  });

  std::array<std::int64_t, 2> cpu_ns{};
  shared->size_bytes.store(static_cast<std::size_t>(state.range(0)));
  for ([[maybe_unused]] auto _ : state) {
    for (int round = 0; round < 2 * kRounds; ++round) {
      const bool is_bare = round % 2 == 0;
      arrived.store(0);
      const std::int64_t cpu_before = cpu_time_ns();
      shared->task.store(is_bare ? Shared::Task::bare : Shared::Task::takt);
      wait_until([&] { return shared->task.load() == Shared::Task::none; });
      wait_until([&] { return arrived.load() == kMessages; });
      cpu_ns[is_bare ? 0 : 1] += cpu_time_ns() - cpu_before + shared->cpu_time_ns.load();
    }
  }
  dds_delete(reader);
  dds_delete_listener(listener);
  executor->cancel();
  spinner.join();
  report(state, bare_latency, takt_latency, cpu_ns);
}
BENCHMARK(latency)->Arg(64)->Arg(1'000)->Arg(10'000)->Arg(100'000)->Iterations(1)->Unit(
    benchmark::kMillisecond);

void service(benchmark::State& state) {
  constexpr int kTrips = 500;
  Histogram topic_trip, service_trip;
  std::binary_semaphore back{0};
  const auto node = make_node();
  const auto ping = node->create_publisher<Parcel>("ping", 10, {.loans = 10});
  const auto pong = node->create_subscription<Parcel>("pong", 10, [&](const Parcel& parcel) {
    topic_trip.record(Nanoseconds(now_ns() - parcel.sent_ns));
    back.release();
  });
  const auto client = node->create_client<Echo>("echo");
  const auto executor = make_executor(node);
  std::jthread spinner([&] { executor->spin(); });
  wait_until([&] {
    return client->service_is_ready() && pong->outside_publisher_count() != 0 &&
           ping->subscription_count() != 0;
  });
  for ([[maybe_unused]] auto _ : state) {
    for (int trip = 0; trip < kTrips; ++trip) {
      std::this_thread::sleep_for(500us);
      auto loan = ping->borrow_loaned_message();
      loan->sent_ns = now_ns();
      ping->publish(std::move(loan));
      back.acquire();
      std::this_thread::sleep_for(500us);
      client->async_send_request({.value = now_ns()}, [&](const Echo::Response* response) {
        service_trip.record(Nanoseconds(now_ns() - response->value));
        back.release();
      });
      back.acquire();
    }
  }
  executor->cancel();
  state.counters["topic_p50_us"] = us(topic_trip, 0.5);
  state.counters["service_p50_us"] = us(service_trip, 0.5);
  state.counters["p50_ratio"] = us(service_trip, 0.5) / us(topic_trip, 0.5);
}
BENCHMARK(service)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  takt::rt::guard_output();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  takt::shared = new (mmap(nullptr, sizeof(takt::Shared), PROT_READ | PROT_WRITE,
                           MAP_SHARED | MAP_ANONYMOUS, -1, 0)) takt::Shared;
  const pid_t child = fork();  // while this process has one thread
  if (child == 0) {
    takt::child();
    _exit(0);
  }
  takt::rt::stay_on(1);
  benchmark::RunSpecifiedBenchmarks();
  takt::shared->task.store(takt::Shared::Task::end);
  waitpid(child, nullptr, 0);
  std::cout.flush();
  return takt::rt::checked_output(std::cout.good() ? 0 : 1);
}
