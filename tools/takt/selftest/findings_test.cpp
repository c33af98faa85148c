// A run and the component's books of it that agree; then one figure after the other is wrong.
// SPDX-License-Identifier: Apache-2.0
#include "selftest/findings.hpp"

#include <functional>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/result.hpp"
#include "takt/measuring/run.hpp"
#include "takt/testing/proves.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kMessages = 1000;

/// So many messages of a topic: each waits for 10 µs or, seldom, for 2 ms, is taken in 1 µs, and
/// executes for 100 µs.
struct Topic {
  explicit Topic(const std::string& name, SelftestRun& run, ProcessResult& result) {
    CallbackStatistics statistics;
    statistics.callback = name;
    statistics.kind = EntityKind::subscription;
    json received = json::array();
    for (std::size_t i = 0; i < kMessages; ++i) {
      const Nanoseconds sent = 1ms * i, waiting = i % 50 == 0 ? 2ms : 10us;
      const Nanoseconds start = sent + waiting + 1us, end = start + 100us;
      run.trace.executions.push_back({.callback = "/stamps/" + name,
                                      .ready = sent,
                                      .picked = sent + waiting,
                                      .start = start,
                                      .end = end});
      received.push_back({sent.count(), (sent - 20us).count(), start.count(), end.count(), false});
      statistics.latency.record(start - sent);
      statistics.execution.record(end - start);
      statistics.deadline_misses += end - sent > 1ms ? 1 : 0;
      chain.record(end - sent + 20us);
    }
    statistics.received = kMessages;
    statistics.dropped = 3;
    statistics.expected = kMessages + 3;
    result.callbacks.push_back({.executor = "default", .statistics = statistics});
    run.books[name] = {{"sent", kMessages + 3}, {"received", std::move(received)}};
  }
  Histogram chain;
};

class SelftestFindings : public testing::Test {
 protected:
  SelftestFindings() {
    ProcessResult result;
    result.name = "selftest";
    const Topic small("small", run_, result);
    const Topic large("large", run_, result), burst("burst", run_, result);
    ProcessResult::ChainResult chain{.name = "chain"};
    chain.statistics.instances = kMessages;
    chain.statistics.latency = small.chain;
    result.chains.push_back(chain);
    ThreadStatistics thread;
    thread.cpu_time = 100ms;
    thread.wall_time = 1s;
    thread.counters.voluntary_switches = 1000;
    result.threads.push_back({.executor = "default", .statistics = thread});
    result.duration_s = 1;
    result.cpu_percent = 10;
    result.pss_kb = 20'000;
    run_.run = rt::run_of(result);
    run_.books["seconds"] = 0.9;
    run_.books["cpu_s"] = 0.09;
    run_.books["wakeups"] = 900;
    run_.books["pss_kb"] = 20'000;
  }
  std::vector<std::string> wrong(const std::function<void(SelftestRun&)>& falsify = {}) {
    SelftestRun run = run_;
    if (falsify) falsify(run);
    Findings findings;
    discarded_ = compare(run, findings);
    std::vector<std::string> result;
    for (const Finding& finding : findings) {
      if (!finding.is_right()) result.push_back(finding.figure);
    }
    return result;
  }
  static CallbackStatistics& small(SelftestRun& run) { return run.run.callbacks[0].statistics; }

  SelftestRun run_;
  std::size_t discarded_ = 0;
};

TEST_F(SelftestFindings, AreRightWhereRunAndBooksAgree) {
  EXPECT_THAT(wrong(), IsEmpty());
  EXPECT_EQ(discarded_, 0u);
}

TEST(SelftestFinding, ThatIsWrongEndsTheCommandAsAFailedRunDoes) {
  proves("command_line.md", "The exit status is 1 if a figure is `WRONG`, or if a run has failed");
  const Finding right{.shown = 2, .independent = 1, .limit = 1};
  const Finding wrong{.shown = 3, .independent = 1, .limit = 1};
  EXPECT_NO_THROW(require_right({right}, 0));
  EXPECT_THROW(require_right({right, wrong}, 0), std::runtime_error);
  EXPECT_THROW(require_right({right}, 1), std::runtime_error);
}

TEST_F(SelftestFindings, SeeAStatisticThatIsWrong) {
  const auto all = [](Nanoseconds time, std::size_t count = kMessages) {
    Histogram histogram;
    for (std::size_t i = 0; i < count; ++i) histogram.record(time);
    return histogram;
  };
  const auto set_exact = [](Histogram& times, std::uint64_t count, Nanoseconds max) {
    times.set_exact(count, times.min(), max, times.sum());
  };
  EXPECT_THAT(wrong([&](SelftestRun& run) {
                set_exact(small(run).latency, kMessages - 10, small(run).latency.max());
              }),
              ElementsAre("small: waiting + take, count"));
  EXPECT_THAT(wrong([&](SelftestRun& run) {
                small(run).latency = all(11us, kMessages - 1);
                small(run).latency.record(2001us);
              }),
              ElementsAre("small: waiting + take, p99, µs"));
  EXPECT_THAT(wrong([&](SelftestRun& run) { set_exact(small(run).latency, kMessages, 2200us); }),
              ElementsAre("small: waiting + take, maximum, µs"));
  EXPECT_THAT(wrong([&](SelftestRun& run) { small(run).execution = all(90us); }),
              testing::Contains("small: execution, p50, µs"));
  EXPECT_THAT(wrong([](SelftestRun& run) { small(run).deadline_misses = 18; }),
              ElementsAre("small: misses"));
  EXPECT_THAT(wrong([](SelftestRun& run) { small(run).dropped = 2; }),
              ElementsAre("small: dropped"));
  EXPECT_THAT(wrong([](SelftestRun& run) { run.run.processes[0].pss_kb = 24'000; }),
              ElementsAre("PSS, MB"));
  EXPECT_THAT(wrong([&](SelftestRun& run) { run.run.chains[0].statistics.latency = all(131us); }),
              ElementsAre("chain: latency p99, µs"));
  EXPECT_THAT(wrong([](SelftestRun& run) { run.run.threads[0].cpu_percent = 8; }),
              ElementsAre("thread's CPU, %", "threads' CPU together, %"));
}

// A sum was compared with another sum of the same readings: a message that was too late by as much
// as another one was too early hid it.
TEST_F(SelftestFindings, SeeMessagesThatAreOff) {
  const auto move = [](SelftestRun& run, bool was_preempted, std::size_t each) {
    json& received = run.books.at("small").at("received");
    for (std::size_t i = 0; i < received.size(); i += each) {
      for (const std::size_t time : {2, 3}) {
        const std::int64_t ns = received[i][time];
        received[i][time] = ns - 800'000;
      }
      received[i][4] = was_preempted;
    }
  };
  EXPECT_THAT(wrong([&](SelftestRun& run) { move(run, false, 50); }),
              ElementsAre("small: waiting + take, messages of 1000 off"));
  EXPECT_THAT(wrong([&](SelftestRun& run) { move(run, true, 50); }), IsEmpty());
  EXPECT_EQ(discarded_, 20u);
  EXPECT_THAT(wrong([&](SelftestRun& run) { move(run, false, 200); }), IsEmpty());
}

TEST_F(SelftestFindings, SeeATraceThatIsNotWhole) {
  EXPECT_THAT(
      wrong([](SelftestRun& run) { run.trace.executions.erase(run.trace.executions.begin()); }),
      ElementsAre("small: executions in the trace"));
}

}  // namespace
}  // namespace takt::tools
