// What a program writes of its run.
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <thread>

#include <nlohmann/json.hpp>

#include "takt/messages/std_msgs/msg/string.hpp"

#include "program_test.hpp"

namespace rclcpp {
namespace {

using ResultsDeathTest = ProgramDeathTest;

/// The run in the file that TAKT_RESULTS names.
nlohmann::json results_in(const std::string& file) {
  std::ifstream text(file);
  return nlohmann::json::parse(text).at("runs").at(0);
}

/// Its rows: "/node/callback by executor" → calls.
std::map<std::string, std::uint64_t> calls_in(const std::string& file) {
  std::map<std::string, std::uint64_t> calls;
  const nlohmann::json run = results_in(file);
  for (const auto& row : run.at("callbacks")) {
    const auto word = [&](const char* key) { return row.at(key).get<std::string>(); };
    calls[word("node") + "/" + word("callback") + " by " + word("executor")] +=
        row.at("received").get<std::uint64_t>();
  }
  return calls;
}

// A program that makes an executor for each call would have a row of each.
TEST_F(ResultsDeathTest, ResultsAreSummedByTheTypeOfTheExecutor) {
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", file().c_str(), 1);
        run([] {
          const auto node = std::make_shared<Node>("node");
          int calls = 0;
          const auto timer = node->create_wall_timer(1ms, [&] { ++calls; });
          while (calls < 5) spin_some(node);
          const auto end = node->create_wall_timer(2ms, [&] {
            if (calls >= 20) rclcpp::shutdown();
          });
          executors::MultiThreadedExecutor pool(ExecutorOptions(), 2);
          pool.add_node(node);
          pool.spin();
        });
      },
      kEndsWell, "");
  const auto calls = calls_in(file());
  EXPECT_GE(calls.at("/node/timer_1ms by single_threaded"), 5u);
  EXPECT_GE(calls.at("/node/timer_1ms by multi_threaded"), 15u);
  EXPECT_FALSE(calls.contains("/node//node/get_parameters by multi_threaded"));
}

// Each executor of `spin_some` counted all messages since the subscription was made, so that most
// seemed lost; and what waits at the end seemed so, too.
TEST_F(ResultsDeathTest, NothingIsLostWhereOneExecutorFollowsAnother) {
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", file().c_str(), 1);
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto publisher = node->create_publisher<std_msgs::msg::String>("topic", 10);
          const auto subscription = node->create_subscription<std_msgs::msg::String>(
              "topic", 10, [](const std_msgs::msg::String&) {});
          for (int i = 0; i < 20; ++i) {
            publisher->publish(std_msgs::msg::String());
            publisher->publish(std_msgs::msg::String());
            executors::SingleThreadedExecutor executor;
            executor.add_node(node);
            executor.spin_once();
          }
          executors::EventsCBGExecutor last;
          last.add_node(node);
          last.spin_once();
        });
      },
      kEndsWell, "");
  std::uint64_t received = 0, dropped = 0;
  const nlohmann::json run = results_in(file());
  for (const auto& row : run.at("callbacks")) {
    if (row.at("kind") != "subscription" || row.at("callback") != "/topic") continue;
    EXPECT_EQ(row.at("lost"), 0) << row;
    received += row.at("received").get<std::uint64_t>();
    dropped += row.at("dropped").get<std::uint64_t>();
  }
  EXPECT_EQ(received, 21u);
  EXPECT_EQ(dropped, 40u - 20 - 9);  // nine wait when the last one begins
}

// Nodes that go before their executor, as in many a main(), were "(removed)" in its trace.
TEST_F(ResultsDeathTest, ATraceNamesCallbacksThatHaveGone) {
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", file().c_str(), 1);
        setenv("TAKT_TRACE", "5", 1);
        run([] {
          executors::SingleThreadedExecutor executor;
          const auto node = std::make_shared<Node>("node");
          int calls = 0;
          const auto timer = node->create_wall_timer(1ms, [&] {
            if (++calls == 10) executor.cancel();
          });
          executor.add_node(node);
          executor.spin();
        });
      },
      kEndsWell, "");
  const nlohmann::json run = results_in(file());
  const auto& events = run.at("trace").at(0).at("events");
  ASSERT_EQ(events.size(), 5u);
  for (const auto& event : events) EXPECT_EQ(event.at(0), "/node/timer_1ms");
}

// It was left out, and a comparison of executors was one of different loads.
TEST_F(ResultsDeathTest, AGroupOfTheFileIsServedUnderAnotherExecutor) {
  EXPECT_EXIT(
      {
        setenv("TAKT_EXECUTOR", "events", 1);
        configure(
            "executors:\n  own: {type: single_threaded, threads: []}\n"
            "nodes:\n  /node: {callback_groups: {group_1: {executor: own}}}\n");
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto group = node->create_callback_group(CallbackGroupType::MutuallyExclusive,
                                                         /*automatically_add_to_executor=*/false);
          const auto timer = node->create_wall_timer(
              1ms, [] { rclcpp::shutdown(); }, group);
          executors::SingleThreadedExecutor executor;
          executor.add_node(node);
          executor.spin();
        });
      },
      kEndsWell, "in force");
}

// A callback of a pool that calls exit waited for a thread that waited for it.
TEST_F(ResultsDeathTest, ACallbackOfAnyExecutorOfTheFileMayExit) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "what is static ends while other threads run";
#endif
  for (const std::string type : {"isolated", "multi_threaded"}) {
    EXPECT_EXIT(
        {
          setenv("TAKT_EXECUTOR", type.c_str(), 1);
          configure("nodes:\n  /node: {}\n");
          run([] {
            const auto node = std::make_shared<Node>("node");
            const auto timer = node->create_wall_timer(1ms, [] { std::exit(0); });
            spin(node);
          });
        },
        kEndsWell, "in force")
        << type;
  }
}

// An executor that spins at exit cannot be asked; all were lost.
TEST_F(ResultsDeathTest, ResultsSayWhatCouldNotBeMeasured) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "what is static ends while other threads run";
#endif
  for (const bool is_configured : {false, true}) {
    EXPECT_EXIT(
        {
          const std::string results = file() + ".json";
          if (is_configured) configure("nodes:\n  /node: {}\n");
          setenv("TAKT_RESULTS", results.c_str(), 1);
          run([] {
            const auto node = std::make_shared<Node>("node");
            const auto timer = node->create_wall_timer(1ms, [] { std::exit(0); });
            spin(node);
          });
        },
        kEndsWell, "");
    EXPECT_NE(results_in(file() + ".json").at("notes").dump().find("still spun when"),
              std::string::npos);
  }
}

// Where only other threads spin, the program ran to its end, and nothing was described.
TEST_F(ResultsDeathTest, NodesAreDescribedWhicheverThreadSpins) {
  EXPECT_EXIT(
      {
        setenv("TAKT_NODES", (file() + ".json").c_str(), 1);
        configure("nodes:\n  /node: {}\n");
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto timer = node->create_wall_timer(1ms, [] {});
          executors::SingleThreadedExecutor executor;
          executor.add_node(node);
          const Spinner spinner(executor);
          std::promise<void>().get_future().wait_for(kLong);
          throw std::runtime_error("it goes on");
        });
      },
      kEndsWell, "in force");
  std::ifstream text(file() + ".json");
  const nlohmann::json described = nlohmann::json::parse(text).at("nodes").at(0);
  EXPECT_EQ(described.at("name"), "/node");
  EXPECT_NE(described.at("callbacks").dump().find("timer_1ms"), std::string::npos);
}

TEST_F(ResultsDeathTest, ResultsThatCannotBeWrittenAreAnErrorAtTheStart) {
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", "/none/results.json", 1);
        run([] {});
      },
      kThrows, "TAKT_RESULTS=/none/results.json: the file cannot be written: No such file");
  EXPECT_EXIT(
      {
        setenv("TAKT_RESULTS", file().c_str(), 1);
        setenv("TAKT_TRACE", "many", 1);
        run([] {});
      },
      kThrows, "TAKT_TRACE=many: no number of executions");
}

}  // namespace
}  // namespace rclcpp
