// SPDX-License-Identifier: Apache-2.0
#include "selftest/findings.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/measuring/rounds.hpp"

#include "selftest/stamps.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// A message, by takt and by the component. Times in µs.
struct Pair {
  double latency = 0, execution = 0;
  double own_latency = 0, own_execution = 0;
  double own_chain = 0;  // from when the timer was due to the end; 0: not known
  bool was_preempted = false;
  double end() const { return latency + execution; }
  double own_end() const { return own_latency + own_execution; }
};

/// A twentieth, as a bucket is 3.2 % wide; or 1.5 µs, on slow machines sixty readings of the clock,
/// for the code between the component's readings and Takt's.
double limit_of_median(double us) {
  return std::max({0.05 * us, 1.5, 60 * clock_reading_us()});
}
/// On a busy machine that code is sometimes in no cache.
double limit_of(double us) {
  return std::max(limit_of_median(us), 5.0);
}

/// What is compared of one run.
class Comparison {
 public:
  Comparison(const SelftestRun& run, Findings& findings) : run_(run), findings_(findings) {}

  void compare_topic(const std::string& topic);
  void compare_thread();
  void compare_process();
  std::size_t discarded() const { return discarded_; }

 private:
  void add(std::string figure, double shown, double independent, double limit) {
    findings_.push_back(
        {std::move(figure), run_.executor, run_.transport, shown, independent, limit});
  }
  const CallbackStatistics& callback_of(const std::string& topic) const;
  std::vector<Pair> pairs_of(const std::string& topic);
  void compare_time(const std::string& topic, const char* name, const Histogram& shown,
                    std::vector<Pair>& pairs, double Pair::*by_takt, double Pair::*own);
  void compare_distribution(const std::string& figure, const Histogram& shown,
                            std::vector<double> values, double extra);
  void compare_misses(const std::string& topic, const std::vector<Pair>& pairs);
  void compare_chains(const std::vector<Pair>& pairs);

  const SelftestRun& run_;
  Findings& findings_;
  std::size_t discarded_ = 0;
};

const CallbackStatistics& Comparison::callback_of(const std::string& topic) const {
  for (const rt::Run::Callback& callback : run_.run.callbacks) {
    if (callback.statistics.callback == topic) return callback.statistics;
  }
  throw Error(fmt::format("a run of the self-test shows no callback '{}'", topic));
}

// In the order in which they were received. None if what was traced is something else.
std::vector<Pair> Comparison::pairs_of(const std::string& topic) {
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) / 1e3; };
  const json& received = run_.books.at(topic).at("received");
  std::vector<const TracedExecution*> traced;
  for (const TracedExecution& execution : run_.trace.executions) {
    if (execution.callback == "/stamps/" + topic) traced.push_back(&execution);
  }
  if (received.empty()) throw Error(fmt::format("no message of '{}' has come", topic));
  add(topic + ": executions in the trace", static_cast<double>(traced.size()),
      static_cast<double>(received.size()), 0);
  if (traced.size() != received.size()) return {};
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < traced.size(); ++i) {
    const TracedExecution& execution = *traced[i];
    const json& own = received[i];
    const auto sent = own[0].get<std::int64_t>(), due = own[1].get<std::int64_t>();
    const auto start = own[2].get<std::int64_t>(), end = own[3].get<std::int64_t>();
    pairs.push_back({.latency = rt::us(execution.picked - execution.ready) +
                                rt::us(execution.start - execution.picked),
                     .execution = rt::us(execution.end - execution.start),
                     .own_latency = us(start - sent),
                     .own_execution = us(end - start),
                     .own_chain = due == 0 ? 0 : us(end - due),
                     .was_preempted = own[4]});
  }
  return pairs;
}

// What is off once counts as preempted where nobody can tell, as between virtual machines; more
// often it is a finding. Either way takt's own time goes into the distribution, which is compared
// with the statistics.
void Comparison::compare_time(const std::string& topic, const char* name, const Histogram& shown,
                              std::vector<Pair>& pairs, double Pair::*by_takt, double Pair::*own) {
  // To give a message of shared memory back takes iceoryx some microseconds, and the callback's
  // execution ends after that.
  const double extra = own == &Pair::own_execution && run_.transport == "shm" ? 20 : 0;
  const double limit = limit_of(0) + extra;  // no bucket lies between, however long it took
  std::size_t off = 0;
  std::vector<double> values;
  for (Pair& pair : pairs) {
    if (std::abs(pair.*by_takt - pair.*own) > limit) {
      ++(pair.was_preempted ? discarded_ : off);
      if (pair.own_chain != 0) pair.own_chain += pair.*by_takt - pair.*own;
      pair.*own = pair.*by_takt;
    }
    values.push_back(pair.*own);
  }
  const auto count = static_cast<double>(pairs.size());
  add(fmt::format("{}: {}, messages of {} off", topic, name, pairs.size()),
      static_cast<double>(off), 0, std::max(2.0, 0.01 * count));
  compare_distribution(fmt::format("{}: {}", topic, name), shown, std::move(values), extra);
}

void Comparison::compare_distribution(const std::string& figure, const Histogram& shown,
                                      std::vector<double> values, double extra) {
  add(figure + ", count", static_cast<double>(shown.count()), static_cast<double>(values.size()),
      0);
  if (shown.count() == 0) return;
  for (const auto& [name, fraction] : {std::pair("p50", 0.5), {"p99", 0.99}, {"maximum", 1.0}}) {
    const double own = percentile(values, fraction);
    add(fmt::format("{}, {}, µs", figure, name),
        rt::us(fraction == 1 ? shown.max() : shown.percentile(fraction)), own,
        (fraction == 0.5 ? limit_of_median(own) : limit_of(own)) + extra);
  }
}

// Close to the deadline, the component's end is not takt's.
void Comparison::compare_misses(const std::string& topic, const std::vector<Pair>& pairs) {
  const double deadline = rt::us(Stamps::kDeadline);
  std::size_t misses = 0, unclear = 0;
  for (const Pair& pair : pairs) {
    misses += pair.own_end() > deadline ? 1 : 0;
    unclear += std::abs(pair.own_end() - deadline) <= 2 * limit_of(0) ? 1 : 0;
  }
  add(topic + ": misses", static_cast<double>(callback_of(topic).deadline_misses),
      static_cast<double>(misses), static_cast<double>(unclear));
}

// The component does not know when the first release was due: so its percentile may be one value
// beside takt's, and on a busy machine these are far apart.
void Comparison::compare_chains(const std::vector<Pair>& pairs) {
  for (const rt::Run::Chain& chain : run_.run.chains) {
    std::vector<double> values;
    for (const Pair& pair : pairs) {
      if (pair.own_chain != 0) values.push_back(pair.own_chain);
    }
    const auto count = static_cast<double>(values.size());
    add("chain: instances", static_cast<double>(chain.statistics.instances), count, 1);
    for (const double fraction : {0.5, 0.99}) {
      const double shown = rt::us(chain.statistics.latency.percentile(fraction));
      double own = 0;
      for (const double beside : {0., -1., 1.}) {
        const double value = percentile(values, std::clamp(fraction + beside / count, 0., 1.));
        if (beside == 0 || std::abs(value - shown) < std::abs(own - shown)) own = value;
      }
      add(fmt::format("chain: latency p{}, µs", 100 * fraction), shown, own, limit_of(own));
    }
  }
}

void Comparison::compare_topic(const std::string& topic) {
  const CallbackStatistics& shown = callback_of(topic);
  const json& own = run_.books.at(topic);
  std::vector<Pair> pairs = pairs_of(topic);
  if (!pairs.empty()) {
    compare_time(topic, "waiting + take", shown.latency, pairs, &Pair::latency, &Pair::own_latency);
    compare_time(topic, "execution", shown.execution, pairs, &Pair::execution,
                 &Pair::own_execution);
    if (topic == "small") {
      compare_misses(topic, pairs);
      compare_chains(pairs);
    }
  }
  const auto sent = own.at("sent").get<double>();
  const auto received = static_cast<double>(own.at("received").size());
  add(topic + ": sent", static_cast<double>(shown.expected), sent, 0);
  add(topic + ": received", static_cast<double>(shown.received), received, 0);
  add(topic + ": dropped", static_cast<double>(shown.dropped), sent - received, 0);
}

// The thread of an executor that has one.
void Comparison::compare_thread() {
  const rt::Run::Thread* thread = nullptr;
  for (const rt::Run::Thread& candidate : run_.run.threads) {
    if (candidate.executor != "default") continue;
    if (thread != nullptr) return;  // several: the component has seen one
    thread = &candidate;
  }
  const double seconds = run_.books.at("seconds");
  if (thread == nullptr || seconds <= 0) return;
  // The thread is counted from release to hold, the component counts between its first and last
  // tick.
  const double cpu_percent = 100 * run_.books.at("cpu_s").get<double>() / seconds;
  add("thread's CPU, %", thread->cpu_percent, cpu_percent, std::max(0.15 * cpu_percent, 1.0));
  const double wakeups = run_.books.at("wakeups").get<double>() / seconds;
  add("thread's wake-ups, 1/s", static_cast<double>(thread->wakeups) / run_.run.duration_s, wakeups,
      std::max(0.1 * wakeups, 50.0));
}

// The process by getrusage, its threads one by one: executors' and Cyclone's.
void Comparison::compare_process() {
  double threads = 0;
  for (const rt::Run::Thread& thread : run_.run.threads) threads += thread.cpu_percent;
  for (const rt::Run::Process& process : run_.run.processes) {
    if (process.name != "selftest") continue;
    const double cpu_percent = process.cpu_percent;
    add("threads' CPU together, %", threads, cpu_percent, std::max(0.05 * cpu_percent, 0.5));
    // The component has looked before the end, and what others share with it comes and goes.
    const double pss_mb = run_.books.at("pss_kb").get<double>() / 1024;
    if (pss_mb == 0) continue;  // a run too short
    add("PSS, MB", static_cast<double>(process.pss_kb) / 1024, pss_mb,
        std::max(0.05 * pss_mb, 3.0));
  }
}

}  // namespace

std::size_t compare(const SelftestRun& run, Findings& findings) {
  Comparison comparison(run, findings);
  for (const char* topic : {"small", "large", "burst"}) comparison.compare_topic(topic);
  comparison.compare_thread();
  comparison.compare_process();
  return comparison.discarded();
}

double percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto rank =
      static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(values.size())));
  return values[std::max<std::size_t>(rank, 1) - 1];
}

void require_right(const Findings& findings, std::size_t failed_runs) {
  const auto wrong = std::count_if(findings.begin(), findings.end(),
                                   [](const Finding& finding) { return !finding.is_right(); });
  if (wrong != 0) {
    throw std::runtime_error(fmt::format(
        "{} of {} figures differ from what was measured independently by more than their limit",
        wrong, findings.size()));
  }
  if (failed_runs != 0) {
    throw std::runtime_error(fmt::format("{} runs have failed, see above", failed_runs));
  }
}

double clock_reading_us() {
  static const double us = [] {
    constexpr int kReadings = 5000, kRounds = 20;
    Nanoseconds least = Nanoseconds::max();  // preempted in none of them
    for (int round = 0; round < kRounds; ++round) {
      const TimePoint start = Clock::steady().now();
      TimePoint last{};
      for (int i = 0; i < kReadings; ++i) last = Clock::steady().now();
      least = std::min(least, last - start);
    }
    return rt::us(least) / kReadings;
  }();
  return us;
}

}  // namespace takt::tools
