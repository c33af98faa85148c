// SPDX-License-Identifier: Apache-2.0
#include "run/decisive_figures.hpp"

#include <algorithm>
#include <map>

#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {
namespace {

class FigureList {
 public:
  explicit FigureList(double seconds) : seconds_(seconds) {}

  /// By the second, with half a count more: a ratio to nothing would be infinite.
  void add_count(const std::string& name, std::uint64_t count, std::uint64_t samples) {
    const double value = (static_cast<double>(count) + 0.5) / seconds_;
    figures_.push_back({name, value, samples, count == 0, true});
  }
  void add_percentile(const std::string& name, const Histogram& latency, double fraction) {
    if (latency.count() == 0) return;
    const double us = fraction == 1 ? rt::us(latency.max()) : interpolated_us(latency, fraction);
    figures_.push_back({name, us, latency.count()});
  }
  void add(const std::string& name, double value) { figures_.push_back({name, value, {}}); }
  std::vector<Figure> take() { return std::move(figures_); }

 private:
  const double seconds_;
  std::vector<Figure> figures_;
};

void add_callbacks(FigureList& figures, const std::vector<rt::Run::Callback>& callbacks) {
  Histogram latency, timer_latency;
  CallbackCounts messages;
  for (const rt::Run::Callback& callback : callbacks) {
    const CallbackStatistics& counted = callback.statistics;
    const bool is_timer = counted.kind == EntityKind::timer;
    (is_timer ? timer_latency : latency).merge(counted.latency);
    if (!is_timer) merge<CallbackCounts>(messages, counted);
  }
  figures.add_count("misses", messages.deadline_misses, messages.received);
  figures.add_percentile("p50", latency, 0.5);
  figures.add_percentile("p99", latency, 0.99);
  figures.add_percentile("max", latency, 1);
  figures.add_percentile("timer_p99", timer_latency, 0.99);
}

/// A chain through several processes is in `chains` once for each.
void add_chains(FigureList& figures, const std::vector<rt::Run::Chain>& chains) {
  std::map<std::string, ChainStatistics> by_name;
  for (const rt::Run::Chain& chain : chains) merge(by_name[chain.name], chain.statistics);
  for (const auto& [name, chain] : by_name) {
    figures.add_count(name + " misses", chain.misses, chain.instances);
    figures.add_percentile(name + " p50", chain.latency, 0.5);
    figures.add_percentile(name + " p99", chain.latency, 0.99);
  }
}

}  // namespace

std::vector<Figure> decisive_figures(const rt::Run& run) {
  if (!(run.duration_s > 0)) return {};
  FigureList figures(run.duration_s);
  add_callbacks(figures, run.callbacks);
  double cpu_percent = 0;
  for (const rt::Run::Process& process : run.processes) cpu_percent += process.cpu_percent;
  figures.add("cpu_%", cpu_percent);
  std::uint64_t wakeups = 0;
  for (const rt::Run::Thread& thread : run.threads) wakeups += thread.wakeups;
  figures.add_count("wakeups/s", wakeups, wakeups);
  add_chains(figures, run.chains);
  return figures.take();
}

double interpolated_us(const Histogram& histogram, double fraction) {
  double held = 0, seen = 0;
  histogram.for_each_bucket(
      [&](std::size_t, Nanoseconds, std::uint64_t count) { held += static_cast<double>(count); });
  std::optional<double> us;
  histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds limit, std::uint64_t of_bucket) {
    const auto count = static_cast<double>(of_bucket);
    if (!us && seen + count >= fraction * held) {
      const double below = bucket == 0 ? 0 : rt::us(Histogram::upper_limit(bucket - 1));
      us = below + (rt::us(limit) - below) * (fraction * held - seen) / count;
    }
    seen += count;
  });
  // The maximum is exact, and the last bucket holds all that is longer.
  return std::clamp(us.value_or(0), rt::us(histogram.min()), rt::us(histogram.max()));
}

}  // namespace takt::tools
