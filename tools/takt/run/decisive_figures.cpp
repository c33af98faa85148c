// SPDX-License-Identifier: Apache-2.0
#include "run/decisive_figures.hpp"

#include <algorithm>

#include "takt/measuring/rounds.hpp"

#include "run/comparison.hpp"

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

}  // namespace

std::vector<Figure> decisive_figures(const rt::Run& run) {
  if (!(run.duration_s > 0)) return {};
  FigureList figures(run.duration_s);
  Totals of;
  of.add(run);
  figures.add_count("misses", of.messages.deadline_misses, of.messages.received);
  figures.add_percentile("p50", of.latency, 0.5);
  figures.add_percentile("p99", of.latency, 0.99);
  figures.add_percentile("max", of.latency, 1);
  figures.add_percentile("timer_p99", of.timer_latency, 0.99);
  if (!run.processes.empty()) figures.add("cpu_%", of.cpu_percent);  // else it is a simulation
  const auto wakeups = static_cast<std::uint64_t>(of.wakeups);
  figures.add_count("wakeups/s", wakeups, wakeups);
  for (const auto& [name, chain] : of.chains) {
    figures.add_count(name + " misses", chain.misses, chain.instances);
    figures.add_percentile(name + " p50", chain.latency, 0.5);
    figures.add_percentile(name + " p99", chain.latency, 0.99);
  }
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
