// Chains from the file: how they are found, what is wrong with them, and what is assigned.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/planning/plan.hpp"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

struct Text {
  int number = 0;
};
TAKT_MESSAGE(Text, "test/msg/Text", number);

/// Publishes `out` from a timer, if it has no `in`; else hands on what comes.
class Step : public Node {
 public:
  explicit Step(const NodeOptions& options) : Node("step", options) {
    using Strings = std::vector<std::string>;
    for (const std::string& topic : declare_parameter<Strings>("out", {})) {
      publishers_.push_back(create_publisher<Text>(topic, 1));
    }
    const auto publish = [this] {
      for (const auto& publisher : publishers_) publisher->publish(Text{});
    };
    for (const std::string& topic : declare_parameter<Strings>("in", {})) {
      entities_.push_back(
          create_subscription<Text>(topic, 1, [publish](const Text&) { publish(); }));
    }
    const auto period = 1ms * declare_parameter<std::int64_t>("period_ms", 10);
    if (entities_.empty()) entities_.push_back(create_timer("timer", period, publish));
  }

 private:
  std::vector<std::shared_ptr<Publisher<Text>>> publishers_;
  std::vector<std::shared_ptr<void>> entities_;
};

// source → a → both → end, source → b → both → end; other → apart.
constexpr std::string_view kNodes = R"(
    - {component: takt::test::Step, name: source, parameters: {out: [x]}}
    - {component: takt::test::Step, name: a, parameters: {in: [x], out: ['y']}}
    - {component: takt::test::Step, name: b, parameters: {in: [x], out: ['y']}}
    - {component: takt::test::Step, name: both, parameters: {in: ['y'], out: [z]}}
    - {component: takt::test::Step, name: end, parameters: {in: [z]}}
    - {component: takt::test::Step, name: other, parameters: {out: [w]}}
    - {component: takt::test::Step, name: apart, parameters: {in: [w]}}
)";

std::string file_with(std::string_view chains) {
  return "container:\n  components:" + std::string(kNodes) + std::string(chains);
}

std::string reading_errors(std::string_view chains) {
  return ConfigurationFile("robot.yaml", file_with(chains)).errors();
}

std::string making_errors(std::string_view text) {
  try {
    const Container container(ConfigurationFile("robot.yaml", text).read());
    return "none";
  } catch (const ConfigurationError& error) {
    return error.what();
  }
}

Plan plan_of(std::string_view chains) {
  return Container(ConfigurationFile("robot.yaml", file_with(chains)).read()).plan();
}

std::vector<std::string> path_of(const PlannedChain& chain) {
  std::vector<std::string> path;
  for (const Chain::Step& step : chain.path) path.push_back(to_string(step));
  return path;
}

TEST(Chains, HaveTheStepsThatTheFileLeavesOut) {
  const Plan plan = plan_of("chains: [{name: c, path: [source/timer, a/x, end/z]}]\n");
  ASSERT_EQ(plan.chains.size(), 1u);
  EXPECT_THAT(path_of(plan.chains[0]), ElementsAre("/source/timer", "/a/x", "/both/y", "/end/z"));
}

// The thread that Takt assigns to it was taken for the one that serves requests: the container had
// a node for these, without what sets its time, and ended the process.
TEST(Chains, MayBeCalledAsAThreadOfTheContainer) {
  EXPECT_EQ(plan_of("chains: [{name: container, path: [source/timer, a/x]}]\n").chains.size(), 1u);
}

TEST(Chains, AutoFindsEveryWayFromATimerToAnEnd) {
  const Plan plan = plan_of("chains: auto\n");
  ASSERT_EQ(plan.chains.size(), 3u);
  EXPECT_THAT(path_of(plan.chains[0]), ElementsAre("/source/timer", "/a/x", "/both/y", "/end/z"));
  EXPECT_THAT(path_of(plan.chains[1]), ElementsAre("/source/timer", "/b/x", "/both/y", "/end/z"));
  EXPECT_THAT(path_of(plan.chains[2]), ElementsAre("/other/timer", "/apart/w"));
}

TEST(Chains, AutoTakesAShorterPeriodForMoreCritical) {
  std::string file = file_with("chains: auto\n");
  file.replace(file.find("{out: [w]}"), 10, "{out: [w], period_ms: 5}");
  const Plan plan = Container(ConfigurationFile("robot.yaml", file).read()).plan();
  ASSERT_EQ(plan.chains.size(), 3u);
  EXPECT_THAT(path_of(plan.chains[0]), ElementsAre("/other/timer", "/apart/w"));
  EXPECT_GT(plan.chains[0].options.priority, plan.chains[1].options.priority);
}

TEST(Chains, ThatDoNotConnectAreErrorsWithTheirLine) {
  EXPECT_THAT(making_errors(file_with("chains:\n  - {name: c, path: [source/timer, apart/w]}\n")),
              AllOf(HasSubstr("robot.yaml:11: chain 'c'"),
                    HasSubstr("no messages go from /source/timer to /apart/w"),
                    HasSubstr("requests to services and their answers are no steps")));
}

TEST(Chains, ThatMayGoSeveralWaysAreErrorsThatTellThem) {
  EXPECT_THAT(making_errors(file_with("chains:\n  - {name: c, path: [source/timer, end/z]}\n")),
              AllOf(HasSubstr("there are several paths"),
                    HasSubstr("/source/timer → /a/x → /both/y → /end/z"), HasSubstr("/b/x")));
}

TEST(Chains, WithNamesThatDoNotExistAreErrors) {
  EXPECT_THAT(reading_errors("chains:\n  - {name: c, path: [sorce/timer]}\n"),
              HasSubstr("robot.yaml:11: 'sorce/timer' names no component"));
  EXPECT_THAT(making_errors(file_with("chains:\n  - {name: c, path: [source/timr]}\n")),
              AllOf(HasSubstr("node '/source' has no callback 'timr'"), HasSubstr("timer")));
}

TEST(Chains, ThatComeBackAreErrors) {
  EXPECT_THAT(reading_errors("chains:\n  - {name: c, path: [a/x, both/y, a/x]}\n"),
              HasSubstr("contains 'a/x' twice"));
}

TEST(Chains, HaveNamesPrioritiesAndDeadlinesThatCanBe) {
  EXPECT_EQ(reading_errors("chains:\n"
                           "  - {name: c, deadline: 0s, path: [a/x]}\n"
                           "  - {name: c, priority: high, path: [a/x]}\n"
                           "  - {path: [a/x]}\n"),
            "robot.yaml:11: a deadline of 0 cannot be met; remove it, or write a longer time\n"
            "robot.yaml:12: 'priority' is 'high'; write an integer\n"
            "robot.yaml:12: two chains have the name 'c'; rename one of them\n"
            "robot.yaml:13: a chain needs the key 'name'; add it\n");
  EXPECT_THAT(reading_errors("chains: automatic\n"), HasSubstr("a list of chains, or auto"));
}

// ---- What is assigned ----

TEST(Plans, GiveChainsExecutorsOfTheirOwnAndLeaveTheRest) {
  const Container container(
      ConfigurationFile(
          "robot.yaml",
          file_with("chains:\n"
                    "  - {name: first, priority: 2, path: [source/timer, a/x, end/z]}\n"
                    "  - {name: second, priority: 1, path: [source/timer, b/x, end/z]}\n"))
          .read());
  std::map<std::string, std::string> executor;
  for (const Plan::Callback& callback : container.plan().callbacks) {
    executor[callback.node->name()] =
        container.executor_of(*callback.node, *callback.entity->group());
  }
  EXPECT_EQ(executor["source"], "first");
  EXPECT_EQ(executor["both"], "first");
  EXPECT_EQ(executor["b"], "second");
  EXPECT_EQ(executor["apart"], "default");
}

TEST(Plans, ChangeNothingThatTheFileGives) {
  SystemDescription system =
      ConfigurationFile(
          "robot.yaml",
          "threads: {first: {policy: SCHED_OTHER, nice: 3}}\n"
          "executors: {mine: {type: events}}\n" +
              file_with("chains:\n  - {name: first, path: [source/timer, a/x, end/z]}\n"))
          .read();
  system.components[1].executor = "mine";
  system.components[3].callbacks["y"] = {.parameters = {.priority = 77}, .where = "here"};
  const Container container(system);
  for (const Plan::Callback& callback : container.plan().callbacks) {
    const auto& group = *callback.entity->group();
    if (callback.node->name() == "a") {
      EXPECT_EQ(container.executor_of(*callback.node, group), "mine");
    }
    if (callback.node->name() == "both") {
      EXPECT_EQ(callback.node->callback_parameters(*callback.entity).priority, 77);
    }
  }
  for (const ThreadDescription& thread : container.description().threads) {
    EXPECT_EQ(thread.attributes.policy, ThreadPolicy::other);
  }
}

// source every 10 ms, other every 5; `end` is also reached from a timer of 2 ms.
TEST(Plans, GiveTheMoreFrequentThePriorityByRateMonotonic) {
  std::string text = file_with(
      "    - {component: takt::test::Step, name: quick, parameters: {out: [z], period_ms: 2}}\n"
      "    - {component: takt::test::Step, name: alone, parameters: {in: [nothing]}}\n"
      "priorities: rate_monotonic\n");
  text.replace(text.find("{out: [w]}"), 10, "{out: [w], period_ms: 5}");
  text.insert(text.find("name: b,") + 7, ", callbacks: {x: {priority: 9}}");
  const Container container(ConfigurationFile("robot.yaml", text).read());
  std::map<std::string, int> priorities;
  for (const Plan::Callback& callback : container.plan().callbacks) {
    priorities[to_string(Chain::Step{callback.node, callback.entity->name()})] =
        callback.node->callback_parameters(*callback.entity).priority.value_or(0);
  }
  EXPECT_THAT(priorities, ElementsAre(Pair("/a/x", 1), Pair("/alone/nothing", 0),
                                      Pair("/apart/w", 2), Pair("/b/x", 9), Pair("/both/y", 1),
                                      Pair("/end/z", 3), Pair("/other/timer", 2),
                                      Pair("/quick/timer", 3), Pair("/source/timer", 1)));
}

TEST(Plans, RefuseMoreWorkThanAThreadHas) {
  EXPECT_THAT(
      making_errors("executors:\n  small: {type: events}\ncontainer:\n  components:\n"
                    "    - {component: takt::test::Step, name: one, executor: small,\n"
                    "       parameters: {out: [x]}, callbacks: {timer: {budget: 6ms}}}\n"
                    "    - {component: takt::test::Step, name: two, executor: small,\n"
                    "       parameters: {out: [x]}, callbacks: {timer: {budget: 5ms}}}\n"),
      AllOf(HasSubstr("robot.yaml:2:"), HasSubstr("executor 'small' are 110 % of its 1 thread")));
}

TEST(Plans, RefuseABudgetAboveThePeriod) {
  EXPECT_THAT(making_errors("container:\n  components:\n"
                            "    - component: takt::test::Step\n"
                            "      callbacks: {timer: {budget: 11ms}}\n"),
              AllOf(HasSubstr("robot.yaml:4:"),
                    HasSubstr("the budget of 11ms is above the period of 10ms")));
}

TEST(Plans, RefuseListedCallbacksThatTheExecutorHasNot) {
  EXPECT_THAT(making_errors("executors:\n  t: {type: triggered, trigger: {one: one/tmer}}\n"
                            "container:\n  components:\n"
                            "    - {component: takt::test::Step, name: one, executor: t}\n"),
              AllOf(HasSubstr("robot.yaml:2: executor 't' has no callback 'one/tmer'"),
                    HasSubstr("one/timer")));
}

// ---- Changes while it runs ----

TEST(SetCallbackParameters, ChangesWhatTheRequestSaysOrNothing) {
  SystemDescription system =
      ConfigurationFile("robot.yaml", "threads: {container: {}}\n" + file_with("")).read();
  system.name = "my robot";
  Container container(system);
  container.start();
  const auto asker = std::make_shared<Node>("asker");
  const auto client =
      asker->create_client<SetCallbackParameters>("/my_robot/set_callback_parameters");
  const auto executor = executors().make("events", {});
  executor->add_node(asker);
  const auto ask = [&](const std::string& changes) {
    const auto answer = client->async_send_request({changes});
    EXPECT_EQ(executor->spin_until_future_complete(answer, 10s), FutureReturnCode::SUCCESS);
    return answer.get();
  };
  const auto parameters = [&](std::string_view node) {
    for (const Plan::Callback& callback : container.plan().callbacks) {
      if (callback.node->name() == node) {
        return callback.node->callback_parameters(*callback.entity);
      }
    }
    return CallbackParameters{};
  };

  const auto changed =
      ask("a: {callbacks: {x: {priority: 9}}}\n"
          "/b: {callback_groups: {default: {deadline: 3ms, overrun: skip}}}\n");
  ASSERT_TRUE(changed.has_value());
  EXPECT_TRUE(changed->success) << changed->reason;
  EXPECT_EQ(parameters("a").priority, 9);
  EXPECT_EQ(parameters("b").deadline, 3ms);
  EXPECT_EQ(parameters("b").overrun, OverrunPolicy::skip);

  for (const auto& [request, reason] : std::map<std::string, std::string>{
           {"a: {callbacks: {x: {priority: 1}}}\nnobody: {}\n", "no component is called '/nobody'"},
           {"a: {callbacks: {q: {priority: 1}}}\n", "has no callback 'q'"},
           {"a: {callbacks: {x: {prority: 1}}}\n", "'prority' is not a key of a callback"},
           {"source: {callbacks: {timer: {budget: 1s}}}\n", "above the period of 10ms"},
           {"a: [", "request:"}}) {
    const auto refused = ask(request);
    ASSERT_TRUE(refused.has_value());
    EXPECT_FALSE(refused->success) << request;
    EXPECT_THAT(refused->reason, HasSubstr(reason));
  }
  EXPECT_EQ(parameters("a").priority, 9);
  container.hold();
  container.stop();
}

}  // namespace

namespace test {
using takt::Step;
}
}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::test::Step, "hands on what comes")
