// Tests of the keys `threads` and `executors`: what is read, and what each mistake is called.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::StartsWith;

class ThreadsAndExecutors : public testing::Test {
 protected:
  ThreadsAndExecutors() { provide_workload(); }
  static SystemDescription read(const std::string& text) {
    return ConfigurationFile("robot.yaml", text).read();
  }
  // The errors of a file that is right but for these lines, which come first.
  static std::string errors_of(const std::string& lines) {
    const std::string system = "container: {components: [{component: takt::Workload}]}\n";
    return ConfigurationFile("robot.yaml", lines + system).errors();
  }
};

TEST_F(ThreadsAndExecutors, RefusesThreadsThatCannotBe) {
  EXPECT_EQ(errors_of("threads:\n  control:\n    policy: SCHED_OTHER\n    priority: 80\n"),
            "robot.yaml:4: priority 80 means nothing for SCHED_OTHER; leave it out, or choose "
            "SCHED_FIFO or SCHED_RR\n");
  EXPECT_EQ(errors_of("threads:\n  control: {policy: SCHED_FIFO}\n"),
            "robot.yaml:2: priority 0 does not exist for SCHED_FIFO; choose 1 to 99\n");
  EXPECT_EQ(errors_of("threads:\n  control:\n    nice: 20\n"),
            "robot.yaml:3: nice 20 does not exist; choose -20 to 19\n");
  EXPECT_THAT(errors_of("threads:\n  control:\n    affinity:\n      - 0\n      - 777\n"),
              StartsWith("robot.yaml:5: there is no CPU 777 here; choose from 0"));
  EXPECT_EQ(errors_of("threads: {control: {affinity: [-1]}}\n"),
            "robot.yaml:1: 'affinity[0]' is -1; write an integer from 0 to 2147483647\n");
}

TEST_F(ThreadsAndExecutors, ReadsABandAsAThreadForEachPriority) {
  const SystemDescription system = read(
      "threads: {urgent: {policy: SCHED_FIFO, priority: 60..62, affinity: [0]}}\n"
      "executors: {fast: {type: preemptive, threads: [urgent]}}\n"
      "container: {components: [{component: takt::Workload}]}\n");
  EXPECT_EQ(system.executors.at(0).threads,
            (std::vector<std::string>{"urgent-60", "urgent-61", "urgent-62"}));
  ASSERT_EQ(system.threads.size(), 3u);
  EXPECT_EQ(system.threads[2].attributes.name, "urgent-62");
  EXPECT_EQ(system.threads[2].attributes.priority, 62);
  EXPECT_EQ(system.threads[2].attributes.affinity, std::vector<int>{0});
}

TEST_F(ThreadsAndExecutors, RefusesBandsThatCannotBe) {
  const auto band = [](const std::string& attributes) {
    return errors_of("threads:\n  urgent: {" + attributes +
                     "}\nexecutors: {fast: {type: preemptive, threads: [urgent]}}\n");
  };
  const std::string fifo = "policy: SCHED_FIFO, affinity: [0], priority: ";
  EXPECT_EQ(band(fifo + "60..68"), "no error\n");
  EXPECT_THAT(band(fifo + "68..60"), StartsWith("robot.yaml:2: the band 68..60 of thread 'urgent' "
                                                "does not have 2 to 64 priorities of 1 to 99"));
  EXPECT_THAT(band(fifo + "90..100"), HasSubstr("does not have 2 to 64 priorities"));
  EXPECT_THAT(band(fifo + "60..x"), HasSubstr("write a priority, or a band such as 60..68"));
  EXPECT_THAT(band("policy: SCHED_FIFO, priority: 60..68"), HasSubstr("is not on one CPU"));
  EXPECT_THAT(band("policy: SCHED_RR, affinity: [0], priority: 60..68"),
              HasSubstr("is one of SCHED_RR; choose `policy: SCHED_FIFO`"));
  EXPECT_THAT(band(fifo + "60"), HasSubstr("thread 'urgent' has one priority, and executor 'fast' "
                                           "of type 'preemptive' takes a band"));
  const std::string threads = "threads:\n  urgent: {" + fifo + "60..68}\n";
  EXPECT_EQ(
      errors_of(threads + "  log: {policy: SCHED_FIFO, priority: 68}\n"),
      "robot.yaml:3: thread 'log' may run on CPU 0 with priority 68, inside the band 60..68 of "
      "'urgent'; give it a priority outside of the band, or another CPU\n");
  EXPECT_EQ(errors_of(threads + "  log: {policy: SCHED_FIFO, priority: 69}\n"), "no error\n");
  EXPECT_THAT(errors_of(threads + "  urgent-61: {}\n"),
              HasSubstr("'urgent-61' is one of a band's"));
  EXPECT_THAT(errors_of(threads + "executors: {e: {type: events, threads: [urgent]}}\n"),
              HasSubstr("has a band of priorities, which executor 'e' of type 'events' does not"));
  EXPECT_THAT(errors_of(threads + "dds: {threads: urgent}\n"),
              HasSubstr("thread 'urgent' has a band of priorities; name one with one priority"));
  EXPECT_THAT(errors_of(threads + "executors:\n  a: {type: preemptive, threads: [urgent]}\n"
                                  "  b: {type: preemptive, threads: [urgent]}\n"),
              StartsWith("robot.yaml:5: the band of thread 'urgent' is executor 'a's; give each "));
  EXPECT_THAT(errors_of("executors: {e: {type: preemptive}}\n"),
              HasSubstr("executor 'e' of type 'preemptive' has no threads"));
  EXPECT_THAT(errors_of(threads + "executors: {e: {type: preemptive, scheduler: ros, threads: "
                                  "[urgent]}}\n"),
              HasSubstr("executor 'e' cannot interrupt by the order of 'ros'; choose a scheduler"));
}

TEST_F(ThreadsAndExecutors, ReadsReservations) {
  const SystemDescription system = read(
      "threads: {a: {policy: SCHED_DEADLINE, runtime: 800us, deadline: 5ms, period: 10ms}}\n"
      "executors: {fast: {threads: [a]}}\n"
      "container: {components: [{component: takt::Workload}]}\n");
  const ThreadAttributes& thread = system.threads.at(0).attributes;
  EXPECT_EQ(thread.policy, ThreadPolicy::deadline);
  EXPECT_EQ(thread.runtime, 800us);
  EXPECT_EQ(thread.deadline, 5ms);
  EXPECT_EQ(thread.period, 10ms);
}

TEST_F(ThreadsAndExecutors, RefusesReservationsThatCannotBe) {
  const std::string begin = "threads:\n  control:\n    policy: SCHED_DEADLINE\n";
  EXPECT_EQ(errors_of(begin),
            "robot.yaml:2: SCHED_DEADLINE needs a runtime and a period; give both, such as 2ms and "
            "10ms\n");
  EXPECT_EQ(errors_of(begin + "    period: 10ms\n    runtime: 12ms\n"),
            "robot.yaml:5: runtime 12ms is longer than period 10ms; shorten the runtime\n");
  EXPECT_EQ(errors_of(begin + "    runtime: 2ms\n    period: 10\n"),
            "robot.yaml:5: 'period' is 10; write a number and one of ns, us, ms, s, m, h, such as "
            "20ms\n");
  EXPECT_EQ(errors_of(begin + "    runtime: 2ms\n    period: 10ms\n    priority: 5\n"
                              "    nice: 3\n    affinity: [0]\n"),
            "robot.yaml:6: priority 5 means nothing for SCHED_DEADLINE; leave it out, or choose "
            "SCHED_FIFO or SCHED_RR\n"
            "robot.yaml:7: nice 3 means nothing for SCHED_DEADLINE; leave it out, or choose "
            "SCHED_OTHER or SCHED_BATCH\n"
            "robot.yaml:8: the kernel refuses SCHED_DEADLINE to a thread with an affinity; leave "
            "it out, or run the process in an exclusive cpuset of these CPUs\n");
  EXPECT_EQ(errors_of("threads:\n  control:\n    runtime: 2ms\n"),
            "robot.yaml:3: runtime, deadline and period mean nothing for SCHED_OTHER; leave them "
            "out, or choose SCHED_DEADLINE\n");
}

TEST_F(ThreadsAndExecutors, RefusesReservationsThatTogetherAreMoreThanTheMachine) {
  std::string names = "whole";
  const std::string whole =
      "threads: {whole: {policy: SCHED_DEADLINE, runtime: 9ms, period: 9ms}}\n"
      "executors:\n  rest: {}\n  default: {type: multi_threaded, threads: [";
  EXPECT_EQ(errors_of("threads: {half: {policy: SCHED_DEADLINE, runtime: 4ms, period: 9ms}}\n"
                      "executors:\n  default: {threads: [half]}\n"),
            "no error\n");
  for (std::size_t i = 0; i < available_cpus().size(); ++i) names += ", whole";
  EXPECT_THAT(errors_of(whole + names + "]}\n"),
              AllOf(StartsWith("robot.yaml:2: SCHED_DEADLINE threads reserve "),
                    HasSubstr(" CPUs, of "), HasSubstr("; shorten runtimes, lengthen periods")));
}

// Linux admits all reservations of the machine together, and each process and each isolated node
// has its own.
TEST_F(ThreadsAndExecutors, CountsReservationsOncePerProcessAndIsolatedNode) {
  const auto errors = [](const std::string& type, const std::string& components) {
    return ConfigurationFile("robot.yaml",
                             "machine: {cpus: [0], rt_runtime: 700ms}\n"
                             "threads: {a: {policy: SCHED_DEADLINE, runtime: 4ms, period: 10ms}}\n"
                             "executors:\n  a: {type: " +
                                 type + ", threads: [a]}\n" + components)
        .errors();
  };
  const char* const both =
      "container: {components: [{component: takt::Workload, name: x, executor: a}, "
      "{component: takt::Workload, name: y, executor: a}]}\n";
  const char* const each =
      "containers: [{name: p, components: [{component: takt::Workload, name: x, executor: a}]}, "
      "{name: q, components: [{component: takt::Workload, name: y, executor: a}]}]\n";
  const std::string too_much =
      "robot.yaml:3: SCHED_DEADLINE threads reserve 0.8 CPUs, of 0.7 that there are for them; "
      "shorten runtimes, lengthen periods, or raise kernel.sched_rt_runtime_us\n";
  EXPECT_EQ(errors("events", both), "no error\n");
  EXPECT_EQ(errors("events", each), too_much);
  EXPECT_EQ(errors("isolated", both), too_much);
  // One that no process uses is not made.
  EXPECT_EQ(errors("events", "container: {components: [{component: takt::Workload, name: x}]}\n"),
            "no error\n");
}

// Takt's own threads were not counted: Linux refused one, and the chains were guaranteed.
TEST_F(ThreadsAndExecutors, CountsReservationsOfTaktsOwnThreads) {
  const auto errors = [](const std::string& name, const char* runtime, bool has_two) {
    return ConfigurationFile(
               "robot.yaml",
               fmt::format(
                   "machine: {{cpus: [0], rt_runtime: 900ms}}\n"
                   "threads: {{{}: {{policy: SCHED_DEADLINE, runtime: {}, period: "
                   "10ms}}}}\ncontainers:\n"
                   "  - {{name: p, components: [{{component: takt::Workload, name: x}}]}}\n{}",
                   name, runtime,
                   has_two ? "  - {name: q, components: [{component: takt::Workload, name: z}]}\n"
                           : ""))
        .errors();
  };
  for (const char* const name :
       {"main", "log", "container", "lifecycle", "loader", "signals", "watchdog"}) {
    EXPECT_EQ(errors(name, "8ms", false), "no error\n") << name;
    EXPECT_THAT(errors(name, "8ms", true), HasSubstr("robot.yaml:2: SCHED_DEADLINE threads"))
        << name;
  }
  EXPECT_THAT(errors("requests", "4ms", false), HasSubstr("reserve 1.2 CPUs, of 0.9"));
  EXPECT_THAT(errors("signals", "4ms", true), HasSubstr("reserve 1.2 CPUs, of 0.9"));
}

TEST_F(ThreadsAndExecutors, RefusesThreadsThatSpinAlwaysAndWouldStarveOthers) {
  const std::string spinning =
      "executors:\n  a: {spin: always, threads: [t]}\n"
      "threads:\n  t: {policy: SCHED_FIFO, priority: 1, affinity: [0]}\n";
  if (available_cpus().size() < 2) GTEST_SKIP() << "needs two CPUs";
  EXPECT_EQ(errors_of(spinning), "no error\n");
  EXPECT_THAT(
      errors_of(spinning + "  dds: {}\n"),
      AllOf(StartsWith("robot.yaml:1: thread 't' never sleeps"), HasSubstr("'dds' may run")));
  const std::string anywhere = errors_of(
      "executors:\n  a: {spin: always, threads: [t]}\n"
      "threads:\n  t: {policy: SCHED_RR, priority: 1}\n");
  EXPECT_THAT(anywhere, StartsWith("robot.yaml:2: thread 't' never sleeps"));
  EXPECT_EQ(std::count(anywhere.begin(), anywhere.end(), '\n'), 1) << "reported once";
}

TEST_F(ThreadsAndExecutors, RefusesUnknownPoliciesWithoutFurtherComplaint) {
  EXPECT_EQ(errors_of("threads:\n  control: {policy: SCHED_FIFI, priority: 80}\n"),
            "robot.yaml:2: 'policy' cannot be 'SCHED_FIFI'; did you mean 'SCHED_FIFO'? "
            "valid: SCHED_OTHER, SCHED_FIFO, SCHED_RR, SCHED_BATCH, SCHED_IDLE, SCHED_DEADLINE\n");
}

TEST_F(ThreadsAndExecutors, RefusesUnknownExecutorsAndSchedulers) {
  EXPECT_THAT(errors_of("executors:\n  fast:\n    type: event\n"),
              StartsWith("robot.yaml:3: no executor is called 'event'; did you mean 'events'? "
                         "valid: "));
  EXPECT_THAT(errors_of("executors:\n  fast:\n    type: events\n    scheduler: fivo\n"),
              StartsWith("robot.yaml:4: no scheduler is called 'fivo'; did you mean 'fifo'? "
                         "valid: "));
}

TEST_F(ThreadsAndExecutors, ReadsHowAnExecutorWaits) {
  const SystemDescription system = read(
      "executors:\n  a: {wait: epoll}\n  b: {}\n"
      "container: {components: [{component: takt::Workload}]}\n");
  EXPECT_EQ(system.executors[0].wait, "epoll");
  EXPECT_EQ(system.executors[1].wait, "auto");
  EXPECT_THAT(errors_of("executors:\n  a: {early_wake: 5ms}\n"),
              HasSubstr("robot.yaml:2: executor 'a': early_wake is 5ms; write 0 to 1ms"));
  const SystemDescription spinning = read(
      "executors:\n  a: {spin: 50us}\n  b: {spin: always, threads: [t]}\n"
      "threads: {t: {affinity: [0]}}\n"
      "container: {components: [{component: takt::Workload}]}\n");
  EXPECT_EQ(spinning.executors[0].spin, 50us);
  EXPECT_EQ(spinning.executors[1].spin, kSpinAlways);
  EXPECT_THAT(errors_of("executors:\n  a: {spin: 5ms}\n"),
              HasSubstr("robot.yaml:2: executor 'a': spin is 5ms; write 0 to 1ms"));
  EXPECT_THAT(errors_of("executors:\n  a: {spin: forever}\n"), HasSubstr("robot.yaml:2: "));
  EXPECT_EQ(errors_of("executors:\n  a:\n    wait: epol\n"),
            "robot.yaml:3: no wait back end is called 'epol'; did you mean 'epoll'? valid: epoll, "
            "futex, io_uring\n");
  EXPECT_EQ(errors_of("executors:\n  a:\n    type: multi_threaded\n    wait: io_uring\n"
                      "    threads: [t, t]\nthreads: {t: {}}\n"),
            "robot.yaml:2: 'io_uring' serves one waiting thread, this executor has 2; choose "
            "'epoll', or an executor of one thread\n");
}

TEST_F(ThreadsAndExecutors, ReadsHowManyThreadsAReentrantGroupHas) {
  const SystemDescription system = read(
      "executors:\n  a: {type: isolated, per: group, reentrant_threads: 4}\n"
      "container: {components: [{component: takt::Workload}]}\n");
  EXPECT_EQ(system.executors[0].reentrant_threads, 4);
  EXPECT_EQ(errors_of("executors:\n  a: {type: isolated, reentrant_threads: 4}\n"),
            "robot.yaml:2: executor 'a' has a thread for each node, whatever its groups; leave out "
            "`reentrant_threads`, or write `per: group`\n");
  EXPECT_EQ(errors_of("executors:\n  a: {type: events, reentrant_threads: 4}\n"),
            "robot.yaml:2: executor 'a' is of a type that does not isolate; leave out `per` and "
            "`reentrant_threads`, or choose 'isolated'\n");
  EXPECT_THAT(errors_of("executors:\n  a: {type: isolated, per: group, reentrant_threads: 0}\n"),
              StartsWith("robot.yaml:2: 'reentrant_threads' "));
}

TEST_F(ThreadsAndExecutors, RefusesUnknownThreads) {
  EXPECT_EQ(
      errors_of("threads: {control: {}, bulk: {}}\nexecutors:\n  fast: {threads: [contrl]}\n"),
      "robot.yaml:3: no thread is called 'contrl'; did you mean 'control'? valid: bulk, "
      "control\n");
  EXPECT_EQ(errors_of("executors:\n  fast: {threads: [control]}\n"),
            "robot.yaml:2: no thread is called 'control'; describe it under 'threads'\n");
}

TEST_F(ThreadsAndExecutors, RefusesMoreThreadsThanTheExecutorCanTake) {
  EXPECT_EQ(errors_of("threads: {a: {}, b: {}}\nexecutors:\n  fast:\n    threads: [a, b]\n"),
            "robot.yaml:3: executor 'fast' was given 2 threads; this type takes at most 1\n");
}

}  // namespace
}  // namespace takt
