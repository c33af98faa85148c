// The key `schedulers`: schedulers from libraries, and what is wrong with some of them.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// A file with these schedulers, of which `used` is that of an executor. Beside it lies, as
// libbeside.so, a link to the library of test_schedulers.cpp.
class SchedulersFile {
 public:
  explicit SchedulersFile(const std::string& schedulers, const std::string& used = "fifo")
      : file_("robot.yaml", "executors: {a: {scheduler: " + used +
                                "}}\ncontainer: {components: [{component: takt::Workload}]}\n"
                                "schedulers:\n" +
                                schedulers) {
    provide_workload();
    std::filesystem::create_symlink(TAKT_TEST_SCHEDULERS, folder() / "libbeside.so");
  }
  std::filesystem::path folder() const { return std::filesystem::path(file_.path()).parent_path(); }
  std::string errors() const { return file_.errors(); }
  SystemDescription read() const { return file_.read(); }

 private:
  ConfigurationFile file_;
};

std::string errors_of(const std::string& scheduler) {
  return SchedulersFile("  " + scheduler + ": {library: " TAKT_TEST_SCHEDULERS "}\n").errors();
}

TEST(SchedulerLibrary, BringsASchedulerThatExecutorsMayName) {
  const SchedulersFile file("  good: {library: " TAKT_TEST_SCHEDULERS "}\n", "good");
  EXPECT_EQ(file.read().executors.at(0).scheduler, "good");
  EXPECT_EQ(schedulers().description("good"), "last come, first served");
  const auto executor = executors().make("events", {.scheduler = "good"});
  const auto node = std::make_shared<Node>("node");
  std::string trace;
  const auto a = node->create_guard_condition("a", [&] { trace += "a"; });
  const auto b = node->create_guard_condition("b", [&] { trace += "b"; });
  executor->add_node(node);
  a->trigger();
  b->trigger();
  executor->spin_some();
  EXPECT_EQ(trace, "ba");
}

TEST(SchedulerLibrary, MayBeNamedAgainAndForAnotherOfItsSchedulers) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(SchedulersFile("  good: {library: " TAKT_TEST_SCHEDULERS "}\n"
                             "  also_good: {library: libbeside.so}\n",
                             "also_good")
                  .errors(),
              "no error\n");
  }
}

TEST(SchedulerLibrary, IsFoundBesideTheFileWhateverTheCurrentDirectory) {
  for (const char* library : {"libbeside.so", "./libbeside.so", "../libbeside.so"}) {
    const SchedulersFile file(std::string("  good: {library: ") + library + "}\n");
    if (library == std::string("../libbeside.so")) {
      EXPECT_THAT(file.errors(),
                  AllOf(StartsWith("robot.yaml:4: library '"),
                        HasSubstr("/../libbeside.so: cannot open shared object file"),
                        HasSubstr("; give the path of a shared library that fits this program")));
    } else {
      EXPECT_EQ(file.errors(), "no error\n");
    }
  }
}

TEST(SchedulerLibrary, IsLookedForInTheSystemWhenItIsABareName) {
  EXPECT_EQ(SchedulersFile("  good: {library: libm.so.6}\n").errors(),
            "robot.yaml:4: library 'libm.so.6' registers no scheduler 'good'; say "
            "TAKT_REGISTER_SCHEDULER(\"good\", …) in it\n");
  EXPECT_THAT(
      SchedulersFile("  good: {library: libnowhere.so}\n").errors(),
      StartsWith("robot.yaml:4: library 'libnowhere.so' cannot be loaded: libnowhere.so: "));
}

TEST(SchedulerLibrary, MustRegisterTheName) {
  EXPECT_EQ(errors_of("goood"),
            "robot.yaml:4: library '" TAKT_TEST_SCHEDULERS
            "' registers no scheduler 'goood'; did you mean 'good'? valid: good, also_good, "
            "forgetful, never_made, never_configured, fifo, twice, twice\n");
}

TEST(SchedulerLibrary, MustNotTakeANameThatIsTaken) {
  EXPECT_THAT(errors_of("fifo"),
              StartsWith("robot.yaml:4: the name 'fifo' is taken by another scheduler; register it "
                         "under another name than "));
  EXPECT_EQ(schedulers().description("fifo"), "order of arrival");
  EXPECT_EQ(errors_of("twice"), "robot.yaml:4: library '" TAKT_TEST_SCHEDULERS
                                "' registers scheduler 'twice' twice; give each its own name\n");
  EXPECT_EQ(errors_of("good"), "no error\n");
  EXPECT_THAT(SchedulersFile("  good: {library: " TAKT_OTHER_TEST_SCHEDULERS "}\n").errors(),
              StartsWith("robot.yaml:4: the name 'good' is taken by another scheduler; "));
}

TEST(SchedulerLibrary, MustBringSoundSchedulersAndMayBeTriedAgain) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(errors_of("forgetful"),
              "robot.yaml:4: scheduler 'forgetful' pops nothing, and 1 of 1 callbacks wait; return "
              "every callback once for each push\n");
    EXPECT_EQ(
        errors_of("never_made"),
        "robot.yaml:4: scheduler 'never_made' throws in its constructor: out of order; let it "
        "be made whenever an executor needs one\n");
    EXPECT_EQ(errors_of("never_configured"),
              "robot.yaml:4: scheduler 'never_configured' throws in configure: out of room; take "
              "what it is given\n");
  }
  EXPECT_THAT(schedulers().names(), AllOf(Not(Contains("forgetful")), Not(Contains("never_made")),
                                          Not(Contains("never_configured"))));
}

TEST(SchedulerLibrary, MayComeAfterAFirstTryThatFailed) {
  const SchedulersFile file("  good: {library: libbuilt_later.so}\n", "good");
  EXPECT_THAT(file.errors(), StartsWith("robot.yaml:4: library '"));
  std::filesystem::create_symlink(TAKT_TEST_SCHEDULERS, file.folder() / "libbuilt_later.so");
  EXPECT_EQ(file.errors(), "no error\n");
}

TEST(SchedulerLibrary, ThatFailsIsReportedOnceAndNotAgainWhereItIsUsed) {
  EXPECT_THAT(SchedulersFile("  mine: {library: ./no.so}\n", "mine").errors(),
              AllOf(StartsWith("robot.yaml:4: "), Not(HasSubstr("robot.yaml:1: "))));
  EXPECT_EQ(SchedulersFile("  mine: {}\n").errors(),
            "robot.yaml:4: a scheduler needs the key 'library'; add it\n");
}

}  // namespace
}  // namespace takt
