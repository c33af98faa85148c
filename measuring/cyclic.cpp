// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/cyclic.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <exception>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/executors/executor.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

namespace takt::rt {
namespace {

constexpr std::size_t kOverflowCycles = 100;

class BareLoop final : public CyclicVariant {
 public:
  explicit BareLoop(const CyclicOptions& options)
      : CyclicVariant(options, options.uses_nanosleep ? "nanosleep" : "clock_nanosleep") {}

 private:
  void run(std::uint64_t cycles, const std::atomic<bool>& stop) override {
    RealtimeThread thread(options_.thread, options_.realtime, [&] {
      const RealtimeScope scope;
      const Nanoseconds cpu_time = thread_cpu_time();
      const TimePoint start = Clock::steady().now();
      TimePoint due = later(now(), options_.interval);
      // One cycle more, which does not count: the thread is new in each round, its caches are cold.
      for (std::uint64_t cycle = 0; cycle <= cycles && !stop.load(); ++cycle) {
        const bool is_relative = options_.relative || options_.uses_nanosleep;
        if (is_relative) due = later(now(), options_.interval);
        sleep(is_relative ? options_.interval : due.time_since_epoch(), is_relative);
        const TimePoint woken = now();
        if (cycle != 0 && !record(woken - due, woken)) break;
        while ((due = later(due, options_.interval)) <= woken) ++result_.missed;
      }
      result_.counters += scope.so_far();
      result_.cpu_time += thread_cpu_time() - cpu_time;
      result_.wall_time += Clock::steady().now() - start;
    });
    result_.in_force = thread.state();
    thread.join();
  }

  TimePoint now() const noexcept {
    timespec time{};
    clock_gettime(options_.clock, &time);
    return TimePoint(std::chrono::seconds(time.tv_sec) + Nanoseconds(time.tv_nsec));
  }
  void sleep(Nanoseconds until_or_for, bool is_relative) const noexcept {
    const auto seconds = std::chrono::floor<std::chrono::seconds>(until_or_for);
    const timespec time{seconds.count(), (until_or_for - seconds).count()};
    if (options_.uses_nanosleep) {
      while (nanosleep(&time, nullptr) != 0) {
      }
      return;
    }
    while (clock_nanosleep(options_.clock, is_relative ? 0 : TIMER_ABSTIME, &time, nullptr) != 0) {
    }
  }
};

class ExecutorTimer final : public CyclicVariant {
 public:
  ExecutorTimer(const CyclicOptions& options, const std::string& executor, Nanoseconds early_wake)
      : CyclicVariant(options,
                      early_wake == Nanoseconds::zero()
                          ? executor
                          : fmt::format("{} early_wake={}us", executor, early_wake.count() / 1000)),
        type_(executor),
        early_wake_(early_wake) {
    executors().check(executor);
  }

 private:
  void run(std::uint64_t cycles, const std::atomic<bool>& stop) override {
    ExecutorOptions options{.name = options_.thread.name, .threads = {options_.thread}};
    options.realtime = options_.realtime;
    options.early_wake = early_wake_;
    const auto executor = executors().make(type_, options);
    const auto node =
        std::make_shared<Node>(options_.thread.name.empty() ? "latency" : options_.thread.name);
    std::uint64_t cycle = 0;
    const auto timer = node->create_timer("timer", options_.interval, [&] {
      const TimePoint now = Clock::steady().now();
      if (cycle > cycles) return;  // it has been cancelled, but its thread has not ended yet
      const bool goes_on = cycle == 0 || record(now - Dispatch::current()->root_release, now);
      if (++cycle > cycles || !goes_on || stop.load()) executor->cancel();
    });
    timer->cancel();
    // Start the timer when the thread runs, so that its start does not count as latency.
    const auto begin = node->create_guard_condition("begin", [&] { timer->reset(); });
    executor->add_node(node);
    begin->trigger();
    std::exception_ptr exception;
    std::thread([&] {  // spin() gives this thread the attributes
      try {
        executor->spin();
      } catch (...) {
        exception = std::current_exception();
      }
    })
        .join();
    if (exception != nullptr) std::rethrow_exception(exception);
    result_.missed += timer->missed();
    bool is_first = true;
    for (const ThreadStatistics& thread : executor->thread_statistics()) {
      if (is_first) result_.in_force = thread.in_force;
      if (is_first) result_.wall_time += thread.wall_time;
      is_first = false;
      result_.counters += thread.counters;
      result_.cpu_time += thread.cpu_time;
    }
  }

  const std::string type_;
  const Nanoseconds early_wake_;
};

}  // namespace

CyclicResult::CyclicResult(const CyclicOptions& options)
    : bins(options.bins), bin_(options.bin), break_above_(options.break_above) {
  overflow_cycles.reserve(kOverflowCycles);
}

Nanoseconds CyclicResult::mean() const noexcept {
  return cycles == 0 ? Nanoseconds::zero() : sum / static_cast<std::int64_t>(cycles);
}

double CyclicResult::cpu_percent() const noexcept {
  return wall_time == Nanoseconds::zero() ? 0
                                          : 100.0 * static_cast<double>(cpu_time.count()) /
                                                static_cast<double>(wall_time.count());
}

bool CyclicResult::record(Nanoseconds value) noexcept {
  const auto bin = static_cast<std::size_t>(std::max<std::int64_t>(value / bin_, 0));
  if (bin < bins.size()) {
    ++bins[bin];
  } else {
    ++overflows;
    if (overflow_cycles.size() < overflow_cycles.capacity()) overflow_cycles.push_back(cycles);
  }
  ++cycles;
  if (value < Nanoseconds::zero()) ++early;
  min = std::min(min, value);
  max = std::max(max, value);
  last = value;
  sum += value;
  broke = break_above_ != Nanoseconds::zero() && value > break_above_;
  return !broke;
}

CyclicVariant::CyclicVariant(const CyclicOptions& options, const std::string& name)
    : options_(options), result_(options) {
  result_.name = name;
}

void CyclicVariant::mark(Nanoseconds latency) const noexcept {
  if (options_.trace_marker < 0) return;
  std::array<char, 96> text;
  const int size =
      std::snprintf(text.data(), text.size(), "hit latency threshold (%lld ns > %lld ns)\n",
                    static_cast<long long>(latency.count()),
                    static_cast<long long>(options_.break_above.count()));
  // Without the mark the trace is worth less, but the measurement is not.
  [[maybe_unused]] const ssize_t written =
      write(options_.trace_marker, text.data(), static_cast<std::size_t>(size));
}

void CyclicVariant::round(std::uint64_t cycles, const std::atomic<bool>& stop) {
  round_ = Histogram();
  round_begin_ = Clock::steady().now() - beginning_;
  values_.clear();
  if (options_.keeps_values) values_.reserve(cycles);
  run(cycles, stop);
  if (round_.count() != 0) result_.rounds.add(round_);
}

void CyclicVariant::expect(TimePoint beginning, Nanoseconds end) {
  beginning_ = beginning;
  if (!result_.over_time) result_.over_time.emplace();
  result_.over_time->make_room(end);
}

std::unique_ptr<CyclicVariant> bare_loop(const CyclicOptions& options) {
  return std::make_unique<BareLoop>(options);
}

std::unique_ptr<CyclicVariant> executor_timer(const CyclicOptions& options,
                                              const std::string& executor, Nanoseconds early_wake) {
  return std::make_unique<ExecutorTimer>(options, executor, early_wake);
}

void run_together(std::span<const std::unique_ptr<CyclicVariant>> rows, std::uint64_t cycles,
                  CyclesOf of, std::atomic<bool>& stop) {
  const auto cycles_of = [&](const CyclicVariant& row) {
    if (of == CyclesOf::each) return cycles;
    const Nanoseconds time = static_cast<std::int64_t>(cycles) * rows.front()->options().interval;
    return static_cast<std::uint64_t>(std::max<std::int64_t>(time / row.options().interval, 1));
  };
  std::vector<std::exception_ptr> failed(rows.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      threads.emplace_back([&, i] {
        try {
          rows[i]->round(cycles_of(*rows[i]), stop);
        } catch (...) {
          failed[i] = std::current_exception();
        }
        if (failed[i] != nullptr || rows[i]->result().broke) stop.store(true);
      });
    }
  }
  for (const std::exception_ptr& exception : failed) {
    if (exception != nullptr) std::rethrow_exception(exception);
  }
}

void find_gaps(const CyclicOptions& options, Nanoseconds duration, Gaps& gaps) {
  RealtimeThread(options.thread, options.realtime, [&] {
    const TimePoint start = Clock::steady().now();
    TimePoint before = start;
    while (before - start < duration) {
      const TimePoint now = Clock::steady().now();
      if (const Nanoseconds gap = now - before; gap > Gaps::kThreshold) {
        ++gaps.count;
        gaps.total += gap;
        gaps.longest = std::max(gaps.longest, gap);
      }
      before = now;
    }
    gaps.observed += before - start;
  }).join();
}

}  // namespace takt::rt
