// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/diagnostics.hpp"

#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/counted.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/statistics_interval.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;
using diagnostic_msgs::msg::KeyValue;

DiagnosticStatus status_of(const std::string& host, const std::string& what) {
  DiagnosticStatus status;
  status.name = host + ": " + what;
  status.message = "ok";
  status.hardware_id = host;
  return status;
}

template <class T>
void put(DiagnosticStatus& status, const char* key, const T& value) {
  KeyValue pair;
  pair.key = key;
  if constexpr (std::is_floating_point_v<T>) {
    pair.value = fmt::format("{:.1f}", value);
  } else {
    pair.value = fmt::format("{}", value);
  }
  status.values.push_back(std::move(pair));
}

void put(DiagnosticStatus& status, const char* what, const StatisticsInterval::Times& times) {
  const auto part = [&](const char* name, const std::optional<Nanoseconds>& time) {
    if (!time) return;
    put(status, fmt::format("{}_{}_us", what, name).c_str(),
        static_cast<double>(time->count()) / 1e3);
  };
  part("p50", times.p50);
  part("p99", times.p99);
  part("max", times.max);
}

void warn(DiagnosticStatus& status, std::uint64_t misses, std::uint64_t dropped,
          std::uint64_t aborted = 0) {
  std::vector<std::string> words;
  if (misses != 0) words.push_back(fmt::format("{} missed", counted(misses, "deadline")));
  if (dropped != 0) words.push_back(fmt::format("{} dropped", counted(dropped, "message")));
  if (aborted != 0) words.push_back(fmt::format("{} aborted", counted(aborted, "instance")));
  if (words.empty()) return;
  status.level = DiagnosticStatus::WARN;
  status.message = fmt::format("{}", fmt::join(words, ", "));
}

DiagnosticStatus bounds_of(const std::string& host,
                           const std::vector<StatisticsInterval::Deviation>& deviations) {
  DiagnosticStatus status = status_of(host, "bounds");
  for (const StatisticsInterval::Deviation& deviation : deviations) {
    put(status, fmt::format("{}_{}", deviation.id, deviation.place + 1).c_str(),
        fmt::format("{}, {} times", deviation.text, deviation.count));
    if (deviation.lately == 0) continue;
    status.level = DiagnosticStatus::WARN;
    status.message = deviation.text;
  }
  return status;
}

}  // namespace

DiagnosticArray diagnostics_of(const std::string& host, const GetStatistics::Response& before,
                               const GetStatistics::Response& now) {
  const StatisticsInterval last = interval(before, now);
  DiagnosticArray array;
  DiagnosticStatus container = status_of(host, "container");
  put(container, "pid", now.pid);
  put(container, "cpu_percent", last.cpu_percent);
  put(container, "threads", last.threads.size());
  array.status.push_back(std::move(container));
  for (const StatisticsInterval::Executor& executor : last.executors) {
    DiagnosticStatus status = status_of(host, "executor " + executor.name);
    warn(status, executor.faults.deadline_misses, executor.faults.dropped);
    put(status, "type", executor.type);
    put(status, "scheduler", executor.scheduler);
    put(status, "cpu_percent", executor.cpu_percent);
    put(status, "rate_hz", executor.rate);
    put(status, "pending", executor.pending);
    array.status.push_back(std::move(status));
  }
  for (const StatisticsInterval::Callback& callback : last.callbacks) {
    DiagnosticStatus status = status_of(host, "callback " + callback.name());
    warn(status, callback.faults.deadline_misses, callback.faults.dropped);
    put(status, "executor", callback.executor);
    put(status, "rate_hz", callback.rate);
    put(status, "latency", callback.latency);
    put(status, "execution", callback.execution);
    put(status, "overruns", callback.faults.overruns);
    put(status, "backlog", callback.backlog);
    array.status.push_back(std::move(status));
  }
  for (const StatisticsInterval::Chain& chain : last.chains) {
    DiagnosticStatus status = status_of(host, "chain " + chain.name);
    warn(status, chain.faults.misses, 0, chain.faults.aborted);
    put(status, "rate_hz", chain.rate);
    put(status, "latency", chain.latency);
    array.status.push_back(std::move(status));
  }
  if (last.watches_bounds) array.status.push_back(bounds_of(host, last.deviations));
  return array;
}

Diagnostics::Diagnostics(const Container& container, Node& host,
                         std::shared_ptr<CallbackGroup> group)
    : container_(container),
      host_(host),
      publisher_(host.create_publisher<DiagnosticArray>(kDiagnosticsTopic, 10)),
      timer_(host.create_wall_timer(
          "diagnostics", 1s, [this] { look(); }, std::move(group))) {
  timer_->cancel();
  publisher_->events()->set_listener(EndpointEvent::matched, this);
  happened();  // a subscription may have come before
}

Diagnostics::~Diagnostics() {
  publisher_->events()->remove_listener(EndpointEvent::matched, this);
  wait_for_readers();
}

// By the event's status: the publisher's own count changes only after the matched event.
bool Diagnostics::is_wanted() const noexcept {
  return publisher_->events()->status(MatchedStatus()).current_count > 0;
}

// Any thread: a subscription has come or gone.
void Diagnostics::happened() noexcept {
  if (is_wanted() && timer_->is_canceled()) timer_->reset();
}

void Diagnostics::look() {
  if (!is_wanted()) {
    before_ = {};
    timer_->cancel();
    return happened();  // a subscription may have come meanwhile
  }
  GetStatistics::Response now = container_.statistics();
  if (before_.pid != 0) {
    DiagnosticArray array = diagnostics_of(host_.name(), before_, now);
    array.header.stamp = host_.now();
    publisher_->publish(array);
  }
  before_ = std::move(now);
}

}  // namespace takt
