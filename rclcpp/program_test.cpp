// What the environment changes. Each test is a program of its own, as it is read once.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <thread>

#include "takt/base/temporary.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

/// A file of this content while the program runs.
class ConfigurationFile {
 public:
  explicit ConfigurationFile(const std::string& text) {
    std::ofstream(folder_ / "robot.yaml") << text;
    setenv("TAKT_CONFIG", (folder_ / "robot.yaml").c_str(), 1);
  }

 private:
  const takt::TemporaryFolder folder_;
};

/// Ends the program with what the function throws, as a program without `try` would, but with a
/// status.
template <class F>
[[noreturn]] void run(F&& program) {
  try {
    rclcpp::init(0, nullptr);
    program();
    rclcpp::shutdown();
    std::exit(0);
  } catch (const std::exception& error) {
    std::cerr << "threw: " << error.what() << '\n';
    std::exit(3);
  }
}

std::string thread_name() {
  char name[16] = {};
  pthread_getname_np(pthread_self(), name, sizeof name);
  return name;
}

/// Calls once, and ends the spin of the program.
auto once(Executor& executor) {
  return [&executor](TimerBase& timer) {
    std::cerr << "called by " << thread_name() << '\n';
    timer.cancel();
    executor.cancel();
  };
}

class ProgramDeathTest : public testing::Test {
 protected:
  ProgramDeathTest() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};
const auto kEndsWell = testing::ExitedWithCode(0);
const auto kThrows = testing::ExitedWithCode(3);

TEST_F(ProgramDeathTest, AnExecutorIsReplacedByTheEnvironment) {
  EXPECT_EXIT(
      {
        setenv("TAKT_EXECUTOR", "events", 1);
        setenv("TAKT_SCHEDULER", "fifo", 1);
        run([] {
          const auto node = std::make_shared<Node>("node");
          executors::MultiThreadedExecutor executor(ExecutorOptions(), 3);
          const auto timer = node->create_wall_timer(1ms, once(executor));
          executor.add_node(node);
          executor.spin();
        });
      },
      kEndsWell,
      "note: TAKT_EXECUTOR=events is in force\nnote: TAKT_SCHEDULER=fifo is in force\ncalled by");
}

TEST_F(ProgramDeathTest, EveryExecutorServesTheFunctionsThatSpin) {
  for (const std::string& name : takt::executors().names()) {
    EXPECT_EXIT(
        {
          setenv("TAKT_EXECUTOR", name.c_str(), 1);
          run([] {
            const auto node = std::make_shared<Node>("node");
            std::promise<void> called;
            const auto timer = node->create_wall_timer(1ms, [&](TimerBase& self) {
              self.cancel();
              called.set_value();
            });
            auto future = called.get_future().share();
            if (spin_until_future_complete(node, future, kLong) != FutureReturnCode::SUCCESS) {
              throw std::runtime_error("it was not called");
            }
            spin_some(node);
            const auto end = node->create_wall_timer(1ms, [] { rclcpp::shutdown(); });
            spin(node);
          });
        },
        kEndsWell, "")
        << name;
  }
}

TEST_F(ProgramDeathTest, AWrongNameIsAnErrorWithTheValidOnes) {
  EXPECT_EXIT(
      {
        setenv("TAKT_EXECUTOR", "event", 1);
        run([] {});
      },
      kThrows,
      "threw: TAKT_EXECUTOR: no executor is called 'event'; did you mean 'events'. valid: ");
  EXPECT_EXIT(
      {
        setenv("TAKT_SCHEDULER", "edff", 1);
        run([] {});
      },
      kThrows, "threw: TAKT_SCHEDULER: no scheduler is called 'edff'; did you mean 'edf'. valid: ");
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG", "/none/robot.yaml", 1);
        run([] {});
      },
      kThrows, "/none/robot.yaml");
}

const std::string kThreads =
    "realtime: prefer\n"
    "threads:\n"
    "  fast_thread: {affinity: [0]}\n"
    "executors:\n"
    "  fast: {type: events, scheduler: fixed_priority, threads: [fast_thread]}\n";

TEST_F(ProgramDeathTest, AFileGivesThreadsToNodesAndGroups) {
  EXPECT_EXIT(
      {
        const ConfigurationFile file(kThreads +
                                     "  slow: {threads: []}\n"
                                     "nodes:\n"
                                     "  /front/node:\n"
                                     "    executor: fast\n"
                                     "    callback_groups: {group_1: {executor: slow}}\n"
                                     "    callbacks: {timer_1ms: {deadline: 1h}}\n");
        run([] {
          const auto node = std::make_shared<Node>("node", "front");
          const auto other = std::make_shared<Node>("other");
          std::atomic<int> calls = 0;
          executors::SingleThreadedExecutor executor;
          const auto count = [&](const std::string& name) {
            return [&, name](TimerBase& self) {
              std::cerr << name + " is called by " + thread_name() + "\n";
              self.cancel();
              if (++calls == 3) executor.cancel();
            };
          };
          const auto group = node->create_callback_group(CallbackGroupType::MutuallyExclusive,
                                                         /*automatically_add_to_executor=*/false);
          const auto one = node->create_wall_timer(1ms, count("one"));
          const auto two = node->create_wall_timer(20ms, count("two"), group);
          const auto three = other->create_wall_timer(40ms, count("three"));
          executor.add_node(node);
          executor.add_callback_group(group, node->get_node_base_interface());
          executor.add_node(other);
          executor.spin();
          executor.remove_node(node);
        });
      },
      kEndsWell,
      "one is called by fast_thread\n(.*\n)*two is called by slow\n(.*\n)*three is called by "
      ".*test");
}

// What follows is wrong at the first spin, and not before, as a program makes its nodes by then.
TEST_F(ProgramDeathTest, ANameThatNobodyHasIsAnError) {
  const auto spin_with = [](const std::string& nodes) {
    const ConfigurationFile file(kThreads + nodes);
    run([] {
      const auto node = std::make_shared<Node>("camera");
      const auto timer = node->create_wall_timer(100ms, [] { rclcpp::shutdown(); });
      spin(node);
    });
  };
  EXPECT_EXIT(spin_with("nodes:\n  /camara: {executor: fast}\n"), kThrows,
              "robot.yaml:7: this program has no node '/camara'; did you mean '/camera'");
  EXPECT_EXIT(
      spin_with("nodes:\n  /camera:\n    callbacks:\n      timer_10ms: {priority: 1}\n"), kThrows,
      "robot.yaml:9: node '/camera' has no callback 'timer_10ms'; did you mean 'timer_100ms'");
  EXPECT_EXIT(
      spin_with("nodes:\n  /camera:\n    callback_groups:\n      defalt: {priority: 1}\n"), kThrows,
      "robot.yaml:9: node '/camera' has no callback group 'defalt'; did you mean 'default'");
  EXPECT_EXIT(spin_with("nodes:\n  /camera: {executor: fsat}\n"), kThrows,
              "robot.yaml:7: no executor is called 'fsat'; did you mean 'fast'");
  EXPECT_EXIT(spin_with("container: {components: [{component: takt::Timer}]}\n"), kThrows,
              "robot.yaml");
  EXPECT_EXIT(spin_with("nodes:\n  camera: {executor: fast}\n"), kEndsWell, "in force");
}

TEST_F(ProgramDeathTest, ANameIsMissedAtTheExitOfAProgramThatOnlySpinsSome) {
  EXPECT_EXIT(
      {
        const ConfigurationFile file("nodes:\n  /camera: {}\n  /lidar: {}\n");
        run([] {
          const auto node = std::make_shared<Node>("camera");
          std::atomic<int> calls = 0;
          const auto timer = node->create_wall_timer(1ms, [&] { ++calls; });
          while (calls < 3) {
            spin_some(node);
            std::this_thread::sleep_for(1ms);
          }
        });
      },
      kEndsWell, "error: .*robot.yaml:3: this program has no node '/lidar'; valid: /camera");
}

TEST_F(ProgramDeathTest, NodesMayComeLaterAndGo) {
  EXPECT_EXIT(
      {
        const ConfigurationFile file("nodes:\n  /first: {}\n  /second: {}\n");
        run([] {
          const auto first = std::make_shared<Node>("first");
          std::promise<void> called;
          auto future = called.get_future().share();
          auto second = std::make_shared<Node>("second");
          executors::SingleThreadedExecutor executor;
          TimerBase::SharedPtr of_second;
          const auto of_first = first->create_wall_timer(1ms, [&](TimerBase& self) {
            self.cancel();
            of_second = second->create_wall_timer(1ms, [&](TimerBase& timer) {
              timer.cancel();
              called.set_value();
            });
            executor.add_node(second);
          });
          executor.add_node(first);
          if (executor.spin_until_future_complete(future, kLong) != FutureReturnCode::SUCCESS) {
            throw std::runtime_error("it was not called");
          }
          executor.remove_node(second);
          of_second.reset();
          second.reset();
          for (const std::string& name : first->get_node_names()) {
            if (name == "/second") throw std::runtime_error("it has not gone");
          }
        });
      },
      kEndsWell, "in force");
}

TEST_F(ProgramDeathTest, WhatACallbackThrowsLeavesTheSpin) {
  EXPECT_EXIT(
      {
        const ConfigurationFile file("nodes:\n  /node: {}\n");
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto timer = node->create_wall_timer(1ms, [] { throw std::runtime_error("oh"); });
          spin(node);
        });
      },
      kThrows, "threw: oh");
}

TEST_F(ProgramDeathTest, ChainsAreMeasuredAndGetTheirExecutors) {
  EXPECT_EXIT(
      {
        const ConfigurationFile file(
            "nodes:\n  /node: {}\n"
            "chains:\n  - {name: way, deadline: 1h, path: [node/timer_1ms, node/end]}\n");
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto publisher = node->create_publisher<std_msgs::msg::String>("end", 10);
          const auto timer =
              node->create_wall_timer(1ms, [&] { publisher->publish(std_msgs::msg::String()); });
          const auto end = node->create_subscription<std_msgs::msg::String>(
              "end", 10, [](const std_msgs::msg::String&) {
                std::cerr << "the end is called by " + thread_name() + "\n";
                rclcpp::shutdown();
              });
          spin(node);
        });
      },
      kEndsWell, "the end is called by way");
}

}  // namespace
}  // namespace rclcpp
