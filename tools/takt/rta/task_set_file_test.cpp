// SPDX-License-Identifier: Apache-2.0
#include "rta/task_set_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

analysis::textbook::TaskSet read(const std::string& name, const std::string& text) {
  document::Errors errors("set.json");
  return read_task_set(document::parse_json(text, errors), name, errors);
}

std::vector<std::string> errors(const std::string& name, const std::string& text) {
  try {
    read(name, text);
  } catch (const ConfigurationError& error) {
    return error.errors();
  }
  return {};
}

TEST(TaskSetFile, EveryAnalysisReadsItsExample) {
  for (const std::string& name : analysis::textbook::analyses().names()) {
    const auto set = read(name, analysis::textbook::analyses().traits(name).example);
    const auto result = analysis::textbook::analyse(name, set);
    EXPECT_TRUE(!result.points.empty() || !result.responses.empty()) << name;
    for (const auto& response : result.responses) {
      EXPECT_TRUE(response.bound < analysis::kUnbounded || !response.why_not.empty()) << name;
    }
  }
}

TEST(TaskSetFile, ReadsAllKeys) {
  const auto set = read("np_fp", R"({"supply": {"budget": 3, "period": 5}, "B": 7, "limit": 99,
      "tasks": [{"name": "control", "C": 1, "T": 10, "J": 2, "D": 8, "priority": -3}]})");
  EXPECT_EQ(set.reservation->budget, 3);
  EXPECT_EQ(set.blocking, 7);
  EXPECT_EQ(set.limit, 99);
  EXPECT_EQ(set.tasks[0].name, "control");
  EXPECT_EQ(set.tasks[0].jitter, 2);
  EXPECT_EQ(set.tasks[0].deadline, 8);
  EXPECT_EQ(set.tasks[0].priority, -3);
  const auto chain = read("wc", R"({"tasks": [{"wcets": [1, 2, 4], "T": 10}]})");
  EXPECT_EQ(chain.tasks[0].execution, 7);
  EXPECT_EQ(chain.tasks[0].last, 4);
}

TEST(TaskSetFile, ReportsAllMistakesWithTheirLines) {
  EXPECT_THAT(errors("fp",
                     "{\"tasks\": [\n{\"C\": -1, \"T\": 0, \"priority\": 1},\n"
                     "{\"C\": 1.5, \"priority\": 1, \"deadline\": 3}]}"),
              ElementsAre(AllOf(HasSubstr("set.json:2: "), HasSubstr("'C' is not possible")),
                          AllOf(HasSubstr("set.json:2: "), HasSubstr("'T' is not possible")),
                          AllOf(HasSubstr("set.json:3: "), HasSubstr("'C' is not a whole number")),
                          AllOf(HasSubstr("set.json:3: "), HasSubstr("fp reads no 'deadline'")),
                          AllOf(HasSubstr("set.json:3: "), HasSubstr("'T' is missing"))));
  EXPECT_THAT(errors("fp", "{\"tasks\": \n[}"), ElementsAre(HasSubstr("set.json:2: ")));
  EXPECT_THAT(errors("fp", "[]"), ElementsAre(HasSubstr("the file is a list; write a map")));
  EXPECT_THAT(errors("fp", "{\"tasks\": []}"),
              ElementsAre(HasSubstr("not a list, or an empty one")));
  EXPECT_THAT(errors("fp", "{}"), ElementsAre(HasSubstr("'tasks' is missing")));
  EXPECT_THAT(errors("fp", "{\"tasks\": [{\"C\": 1, \"T\": 2}]}"),
              ElementsAre(AllOf(HasSubstr("'priority' is missing"), HasSubstr("--help"))));
  EXPECT_THAT(errors("edf", "{\"m\": 2, \"tasks\": [{\"C\": 1, \"T\": 2, \"D\": 2}]}"),
              ElementsAre(HasSubstr("edf reads no 'm'")));
}

TEST(TaskSetFile, RefusesASupplyThatIsNone) {
  const auto refuses = [](const std::string& supply) {
    return errors("wc", "{\"supply\": " + supply + ", \"tasks\": [{\"wcets\": [1], \"T\": 2}]}");
  };
  EXPECT_THAT(refuses("{\"budget\": 6, \"period\": 5}"), ElementsAre(HasSubstr("'supply' is")));
  EXPECT_THAT(refuses("{\"dedicated\": false}"), ElementsAre(HasSubstr("'supply' is")));
  EXPECT_THAT(refuses("{\"dedicated\": true}"), ElementsAre());
}

TEST(TaskSetFile, RefusesExecutorsThatAreNone) {
  const auto refuses = [](const std::string& executors, const std::string& executor) {
    return errors("picas",
                  "{\"executors\": " + executors +
                      ", \"tasks\": [{\"T\": 9, \"callbacks\": [{\"C\": 1, \"executor\": " +
                      executor + ", \"priority\": 1}]}]}");
  };
  EXPECT_THAT(refuses(R"([{"cpu": 0, "priority": 1}])", "1"),
              ElementsAre(HasSubstr("'executor' is not possible")));
  EXPECT_THAT(refuses(R"([{"cpu": 0, "priority": 1}, {"cpu": 0, "priority": 1}])", "1"),
              ElementsAre(HasSubstr("two executors of CPU 0 have priority 1")));
}

}  // namespace
}  // namespace takt::tools
