// The key `library` of an executor: executors from libraries, and what is wrong with some of them.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/simulation/simulation.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kLine2 = "robot.yaml:2: ";

// A file with an executor, in line 2, and more keys. Beside it lies, as libbeside.so, a link to the
// library of test_executors.cpp.
class ExecutorsFile {
 public:
  explicit ExecutorsFile(const std::string& executor, const std::string& more = {})
      : file_("robot.yaml", "executors:\n  a: {" + executor +
                                "}\ncontainer: {components: [{component: takt::test::Ticker, "
                                "executor: a}]}\n" +
                                more) {
    std::filesystem::create_symlink(TAKT_TEST_EXECUTORS, folder() / "libbeside.so");
  }
  std::filesystem::path folder() const { return std::filesystem::path(file_.path()).parent_path(); }
  std::string errors() const { return file_.errors(); }
  SystemDescription read() const { return file_.read(); }

 private:
  ConfigurationFile file_;
};

std::string errors_naming(const std::string& type,
                          const std::string& library = TAKT_TEST_EXECUTORS) {
  return ExecutorsFile("library: " + library + ", type: " + type).errors();
}

ProcessResult result_of(const ExecutorsFile& file) {
  Container container(file.read());
  container.start();
  container.release();
  std::this_thread::sleep_for(50ms);
  container.hold();
  container.stop();
  return container.result();
}

// What holds for those of Takt, holds for one of a library.
TEST(ExecutorLibrary, TheThreadsOfTheFileAndTheStatisticsAreThoseOfABuiltInExecutor) {
  const int cpu = available_cpus().front();
  const std::string threads = fmt::format(
      "threads:\n  first: {{policy: SCHED_BATCH, nice: 3, affinity: [{}]}}\n"
      "  second: {{policy: SCHED_FIFO, priority: 7}}\n",
      cpu);
  for (const std::string type : {"type: multi_threaded", "library: libbeside.so, type: sound"}) {
    SCOPED_TRACE(type);
    const ExecutorsFile file(type + ", threads: [first, second]", threads);
    const TimePoint begin = Clock::steady().now();
    const ProcessResult result = result_of(file);
    ASSERT_EQ(result.threads.size(), 2u);
    const ThreadState& first = result.threads[0].statistics.in_force;
    EXPECT_EQ(first.name, "first");
    EXPECT_EQ(first.policy, ThreadPolicy::batch);
    EXPECT_EQ(first.nice, 3);
    EXPECT_THAT(first.affinity, ElementsAre(cpu));
    const ThreadState& second = result.threads[1].statistics.in_force;
    EXPECT_EQ(second.name, "second");
    if (second.refused.empty()) {
      EXPECT_EQ(second.policy, ThreadPolicy::fifo);
      EXPECT_EQ(second.priority, 7);
    } else {
      EXPECT_THAT(second.refused, HasSubstr("SCHED_FIFO"));
    }
    EXPECT_EQ(result.threads[1].executor, "a");
    EXPECT_GE(result.threads[0].statistics.wall_time, 50ms);
    EXPECT_LT(result.threads[0].statistics.wall_time, Clock::steady().now() - begin);
    ASSERT_EQ(result.callbacks.size(), 2u);
    for (const ProcessResult::Callback& callback : result.callbacks) {
      EXPECT_EQ(callback.executor, "a");
      EXPECT_GT(callback.statistics.received, 0u);
      // Once a millisecond, at the begin and, perhaps, while the timers are held.
      EXPECT_LE(callback.statistics.received,
                static_cast<std::uint64_t>(result.threads[0].statistics.wall_time / 1ms) + 2);
      EXPECT_EQ(callback.statistics.lost(), 0u);
      EXPECT_EQ(callback.statistics.latency.count(), callback.statistics.received);
      EXPECT_EQ(callback.statistics.execution.count(), callback.statistics.received);
    }
    EXPECT_EQ(result.allocations_while_spinning, 0u);
  }
  EXPECT_EQ(executors().description("sound"), "every event at once, for two threads");
}

class Metronome : public Node {
 public:
  explicit Metronome(const NodeOptions& options) : Node("metronome", options) {
    timer_ = create_timer("beat", 10ms, [] {});
  }

 private:
  std::shared_ptr<Timer> timer_;
};

TEST(ExecutorLibrary, IsSimulatedIfItIsOfTheEngine) {
  const auto executions = [](const std::string& type) {
    const ExecutorsFile file("library: libbeside.so, type: " + type, "machine: {cpus: 2}\n");
    SystemDescription system = file.read();
    system.components.front().type = "takt::Metronome";
    system.components.front().callbacks["beat"].execution = {1us, 1us};
    return Simulation(system, {.overrides = {}, .measured = {}, .duration = 1s}).run({}).executions;
  };
  for (const char* type : {"sound", "also_sound", "with_a_rule", "with_bands", "of_the_engine"})
    EXPECT_EQ(executions(type), 100u) << type;
  try {
    executions("by_hand");
    FAIL();
  } catch (const Error& refused) {
    EXPECT_THAT(
        refused.what(),
        HasSubstr("robot.yaml:2: cannot simulate executor 'a': type 'by_hand' is a class of "
                  "its own, which may sleep by itself; choose another, or say `.simulated = "
                  "true` where it is registered"));
  }
}

TEST(ExecutorLibrary, MoreThreadsThanTheTypeHasAreAnError) {
  EXPECT_THAT(ExecutorsFile("library: libbeside.so, type: also_sound, threads: [x, y]",
                            "threads: {x: {}, y: {}}\n")
                  .errors(),
              StartsWith(kLine2));
}

TEST(ExecutorLibrary, MayBeNamedAgainAndForAnotherOfItsExecutors) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(errors_naming("sound"), "no error\n");
    EXPECT_EQ(errors_naming("also_sound", "./libbeside.so"), "no error\n");
  }
  EXPECT_EQ(ExecutorsFile("library: libbeside.so, type: sound}\n  b: {type: sound").errors(),
            "no error\n");
}

TEST(ExecutorLibrary, MayRegisterTheSchedulerOfItsExecutor) {
  EXPECT_EQ(errors_naming("of_its_scheduler"),
            kLine2 +
                "executor 'of_its_scheduler' needs scheduler 'its_own'; name it and its "
                "library under 'schedulers'\n");
  EXPECT_EQ(ExecutorsFile("library: libbeside.so, type: of_its_scheduler",
                          "schedulers: {its_own: {library: libbeside.so}}\n")
                .errors(),
            "no error\n");
}

TEST(ExecutorLibrary, MustBeThereAndOfThisVersion) {
  EXPECT_THAT(errors_naming("sound", "./libnowhere.so"),
              AllOf(StartsWith(kLine2 + "library '"),
                    HasSubstr("; give the path of a shared library that fits this program")));
  EXPECT_THAT(errors_naming("sound", TAKT_OLD_EXECUTORS),
              AllOf(StartsWith(kLine2 + "library '" TAKT_OLD_EXECUTORS
                                        "' was built against Takt 0.0.1, and this is Takt "),
                    HasSubstr("; build it again, against this one")));
}

TEST(ExecutorLibrary, MustRegisterTheName) {
  EXPECT_EQ(
      errors_naming("soundd"),
      kLine2 +
          "library '" TAKT_TEST_EXECUTORS
          "' registers no executor 'soundd'; did you mean 'sound'? valid: never_made, "
          "never_made_either, by_hand, of_the_engine, with_a_rule, with_bands, sound, also_sound, "
          "of_its_scheduler, events, twice, twice\n");
  EXPECT_EQ(errors_naming("sound", TAKT_TEST_SCHEDULERS),
            kLine2 + "library '" TAKT_TEST_SCHEDULERS
                     "' registers no executor 'sound'; say TAKT_REGISTER_EXECUTOR(\"sound\", …) "
                     "in it\n");
  EXPECT_EQ(ExecutorsFile("library: libbeside.so").errors(),
            kLine2 +
                "an executor with the key 'library' needs the key 'type'; add it, with the "
                "name that the library registers\n");
}

TEST(ExecutorLibrary, MustNotTakeANameThatIsTaken) {
  EXPECT_THAT(errors_naming("events"),
              StartsWith(kLine2 + "the name 'events' is taken by another executor; register it "
                                  "under another name than "));
  EXPECT_NE(executors().description("events"), "for tests");
  EXPECT_EQ(errors_naming("twice"), kLine2 +
                                        "library '" TAKT_TEST_EXECUTORS
                                        "' registers executor 'twice' twice; give each its own "
                                        "name\n");
}

TEST(ExecutorLibrary, IsReportedOnceWhenItsConstructorThrows) {
  EXPECT_EQ(errors_naming("never_made"),
            kLine2 +
                "executor 'never_made' throws in its constructor: out of order; let it throw "
                "takt::Error for options that it cannot serve, and nothing else\n");
  EXPECT_THAT(errors_naming("never_made_either"),
              StartsWith(kLine2 + "executor 'never_made_either' throws in its constructor: an "
                                  "object that is not a std::exception; "));
}

// It was added while the library of a scheduler was loaded, whatever its version.
TEST(ExecutorLibrary, AddsNoExecutorThatNoFileNames) {
  EXPECT_THAT(
      ExecutorsFile("type: events", "schedulers: {sound: {library: libbeside.so}}\n").errors(),
      StartsWith("robot.yaml:4: library '"));
  EXPECT_THAT(executors().names(), Not(Contains("twice")));
}

// A sound one: examples/20_wait_backend.
TEST(WaitBackendLibrary, MustWakeWhatItIsPostedFor) {
  const auto errors_of = [](const std::string& name, const std::string& library = "libbeside.so") {
    return ExecutorsFile("wait: " + name,
                         "wait_backends: {" + name + ": {library: " + library + "}}\n")
        .errors();
  };
  EXPECT_EQ(errors_of("never"),
            "robot.yaml:4: wait back end 'never' loses a post; each post ends one wait, also if it "
            "came before\n");
  EXPECT_EQ(errors_of("always"),
            "robot.yaml:4: wait back end 'always' returns a post that never came; each post ends "
            "one wait, also if it came before\n");
  EXPECT_EQ(errors_of("hangs"),
            "robot.yaml:4: wait back end 'hangs' has not returned for 5s; return from `wait` when "
            "its deadline has come, or a post\n");
  EXPECT_THAT(errors_of("futex"), StartsWith("robot.yaml:4: the name 'futex' is taken by another "
                                             "wait back end; "));
  EXPECT_EQ(errors_of("auto"),
            "robot.yaml:4: the name 'auto' means Takt's choice; register another one\n");
  EXPECT_THAT(errors_of("nevr"), AllOf(HasSubstr("registers no wait back end 'nevr'; did you mean "
                                                 "'never'?"),
                                       Not(HasSubstr("robot.yaml:2"))));
  EXPECT_THAT(wait_backends().names(), Not(Contains("never")));
}

}  // namespace
}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Metronome, "has one timer")
