// SPDX-License-Identifier: Apache-2.0
#include "run/decisive_figures.hpp"

#include <algorithm>
#include <map>

#include "takt/measuring/rounds.hpp"

#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

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

struct ChainFigures {
  std::uint64_t instances = 0, misses = 0;
  Histogram latency;
};

void add_callbacks(FigureList& figures, const json& callbacks) {
  Histogram latency, timer_latency;
  std::uint64_t received = 0, misses = 0;
  for (const json& callback : callbacks) {
    const Histogram histogram = read_histogram(callback.at("latency_us"));
    const bool is_timer = callback.at("kind") == "timer";
    (is_timer ? timer_latency : latency).merge(histogram);
    if (is_timer) continue;
    received += callback.at("received").get<std::uint64_t>();
    misses += callback.at("deadline_misses").get<std::uint64_t>();
  }
  figures.add_count("misses", misses, received);
  figures.add_percentile("p50", latency, 0.5);
  figures.add_percentile("p99", latency, 0.99);
  figures.add_percentile("max", latency, 1);
  figures.add_percentile("timer_p99", timer_latency, 0.99);
}

/// A chain through several processes is in `chains` once for each.
void add_chains(FigureList& figures, const json& chains) {
  std::map<std::string, ChainFigures> by_name;
  for (const json& chain : chains) {
    ChainFigures& sum = by_name[chain.at("name")];
    sum.instances += chain.at("instances").get<std::uint64_t>();
    sum.misses += chain.at("misses").get<std::uint64_t>();
    sum.latency.merge(read_histogram(chain.at("latency_us")));
  }
  for (const auto& [name, chain] : by_name) {
    figures.add_count(name + " misses", chain.misses, chain.instances);
    figures.add_percentile(name + " p50", chain.latency, 0.5);
    figures.add_percentile(name + " p99", chain.latency, 0.99);
  }
}

}  // namespace

std::vector<Figure> decisive_figures(const json& run) {
  const double seconds = run.at("duration_s");
  if (!(seconds > 0)) return {};
  FigureList figures(seconds);
  add_callbacks(figures, run.at("callbacks"));
  double cpu_percent = 0;
  for (const json& process : run.at("processes")) {
    cpu_percent += process.at("cpu_percent").get<double>();
  }
  figures.add("cpu_%", cpu_percent);
  std::uint64_t wakeups = 0;
  for (const json& thread : run.at("threads")) wakeups += thread.at("wakeups").get<std::uint64_t>();
  figures.add_count("wakeups/s", wakeups, wakeups);
  add_chains(figures, run.at("chains"));
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
