// What the environment changes. Each test is a program of its own, as it is read once.
// SPDX-License-Identifier: Apache-2.0
#include "program_test.hpp"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>
#include <regex>
#include <thread>

#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/testing/proves.hpp"

namespace rclcpp {
namespace {

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
            {
              executors::MultiThreadedExecutor executor(ExecutorOptions(), 2);
              executor.add_node(node);
              executor.spin_some();
              executor.remove_node(node);
            }
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
        configure("nodes:\n  /camera: {}\n");  // which is looked at again at exit
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
    "  fast_thread: {}\n"
    "executors:\n"
    "  fast: {type: events, scheduler: fixed_priority, threads: [fast_thread]}\n";

TEST_F(ProgramDeathTest, AFileGivesThreadsToNodesAndGroups) {
  EXPECT_EXIT(
      {
        configure(kThreads +
                  "  slow: {threads: []}\n"
                  "nodes:\n"
                  "  /front/node:\n"
                  "    executor: fast\n"
                  "    callback_groups: {group_1: {executor: slow}}\n"
                  "    callbacks: {timer_1ms: {deadline: 1h}}\n");
        run([] {
          const auto node = std::make_shared<Node>("node", "front");
          const auto other = std::make_shared<Node>("other");
          std::mutex mutex;
          std::set<std::string> calls;
          executors::SingleThreadedExecutor executor;
          const auto count = [&](const std::string& name) {
            return [&, name](TimerBase& self) {
              self.cancel();
              const std::lock_guard lock(mutex);
              calls.insert(name + " by " + thread_name());
              if (calls.size() == 3) executor.cancel();
            };
          };
          const auto group = node->create_callback_group(CallbackGroupType::MutuallyExclusive,
                                                         /*automatically_add_to_executor=*/false);
          const auto one = node->create_wall_timer(1ms, count("first"));
          const auto two = node->create_wall_timer(20ms, count("second"), group);
          const auto three = other->create_wall_timer(40ms, count("of the program"));
          executor.add_node(node);
          executor.add_callback_group(group, node->get_node_base_interface());
          executor.add_node(other);
          executor.spin();
          executor.remove_node(node);
          for (const std::string& call : calls) std::cerr << call << '\n';
        });
      },
      kEndsWell, "first by fast_thread\nof the program by rclcpp_test\nsecond by slow\n");
}

// What follows is wrong at the first spin, and not before, as a program makes its nodes by then.
TEST_F(ProgramDeathTest, ANameThatNobodyHasIsAnError) {
  const auto spin_with = [](const std::string& nodes) {
    configure(kThreads + nodes);
    run([] {
      const auto node = std::make_shared<Node>("camera");
      const auto timer = node->create_wall_timer(100ms, [] { rclcpp::shutdown(); });
      spin(node);
    });
  };
  takt::proves(
      "rclcpp.md",
      "A name of the file that nobody has is an error with its line and the nearest valid name");
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

// The name of its container was an exception that ended the program.
TEST_F(ProgramDeathTest, WhoStartsAProgramGivesItAnyName) {
  EXPECT_EXIT(
      {
        static std::string name(300, '\x1b');
        program_invocation_short_name = name.data();
        configure(kThreads + "nodes:\n  /camera: {executor: fast}\n");
        run([] {
          const auto node = std::make_shared<Node>("camera");
          const auto timer = node->create_wall_timer(1ms, [] { rclcpp::shutdown(); });
          spin(node);
        });
      },
      kEndsWell, "in force");
}

TEST_F(ProgramDeathTest, ANameIsMissedAtTheExitOfAProgramThatOnlySpinsSome) {
  EXPECT_EXIT(
      {
        configure("nodes:\n  /camera: {}\n  /lidar: {}\n");
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
      testing::ExitedWithCode(2),
      "error: .*robot.yaml:3: this program has no node '/lidar'; valid: /camera");
}

TEST_F(ProgramDeathTest, NodesMayComeLaterAndGo) {
  EXPECT_EXIT(
      {
        configure("nodes:\n  /first: {}\n  /second: {}\n");
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

// It waited five seconds for its own callback, and its executor stood still; two that dropped each
// other's node, likewise.
TEST_F(ProgramDeathTest, ANodeMayGoInACallbackOfTheFile) {
  EXPECT_EXIT(
      {
        configure(
            "executors:\n  a: {type: events}\n  b: {type: events}\n"
            "nodes:\n  /own: {executor: a}\n  /first: {executor: a}\n  /second: {executor: b}\n");
        run([] {
          auto own = std::make_shared<Node>("own"), first = std::make_shared<Node>("first"),
               second = std::make_shared<Node>("second");
          executors::SingleThreadedExecutor executor;
          executor.add_node(own);
          executor.add_node(first);
          executor.add_node(second);
          std::atomic<int> inside{0};
          const auto drops = [&](std::shared_ptr<Node>& other) {
            return [&](TimerBase& self) {
              self.cancel();
              ++inside;
              EXPECT_TRUE(takt::eventually([&] { return inside >= 2; }));
              other.reset();
              ++inside;
            };
          };
          const auto of_first = first->create_wall_timer(1ms, drops(second), nullptr, false);
          const auto of_second = second->create_wall_timer(1ms, drops(first), nullptr, false);
          const auto of_own = own->create_wall_timer(1ms, [&](TimerBase& self) {
            self.cancel();
            own.reset();
            of_first->reset();
            of_second->reset();
          });
          const Spinner spinner(executor);
          if (!takt::eventually([&] { return inside == 4; })) throw std::runtime_error("it waits");
          std::cerr << "all have gone\n";
        });
      },
      kEndsWell, "in force\nall have gone\n$");
}

// The second of two spins returned while a callback of the file still ran.
TEST_F(ProgramDeathTest, EverySpinReturnsAfterTheCallbacks) {
  EXPECT_EXIT(
      {
        configure("nodes:\n  /first: {}\n  /second: {}\n");
        run([] {
          const auto first = std::make_shared<Node>("first"),
                     second = std::make_shared<Node>("second");
          executors::SingleThreadedExecutor own, other;
          own.add_node(first);
          other.add_node(second);
          std::atomic<bool> is_done = false;
          const auto timer = first->create_wall_timer(1ms, [&] {
            if (!other.is_spinning() || !own.is_spinning()) return;
            rclcpp::shutdown();
            std::this_thread::sleep_for(50ms);
            is_done = true;
          });
          auto spun = std::async(std::launch::async, [&] {
            other.spin();
            return is_done.load();
          });
          own.spin();
          if (!is_done || !spun.get()) throw std::runtime_error("it is too early");
        });
      },
      kEndsWell, "in force");
}

TEST_F(ProgramDeathTest, WhatACallbackThrowsLeavesTheSpin) {
  EXPECT_EXIT(
      {
        configure("nodes:\n  /node: {}\n");
        run([] {
          const auto node = std::make_shared<Node>("node");
          const auto timer = node->create_wall_timer(1ms, [] { throw std::runtime_error("oh"); });
          spin(node);
        });
      },
      kThrows, "threw: oh");
}

std::shared_ptr<Node> static_node;  // is destroyed after what a program has made first

// Its topics were removed from a list that had gone.
TEST_F(ProgramDeathTest, ANodeMayHaveStaticStorage) {
  EXPECT_EXIT(run([] {
                static_node = std::make_shared<Node>("node");
                spin_some(static_node);
              }),
              kEndsWell, "");
}

// It waited for its own thread.
TEST_F(ProgramDeathTest, ACallbackMayExit) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "what is static ends while other threads run";
#endif
  for (const std::string variable : {"TAKT_CONFIG", "TAKT_CONFIG_TEMPLATE"}) {
    EXPECT_EXIT(
        {
          if (variable == "TAKT_CONFIG") configure("nodes:\n  /node: {}\n");
          setenv(variable.c_str(), file().c_str(), 1);
          run([] {
            const auto node = std::make_shared<Node>("node");
            const auto timer = node->create_wall_timer(1ms, [] { std::exit(0); });
            spin(node);
          });
        },
        kEndsWell, "in force")
        << variable;
    std::filesystem::remove(file());
  }
}

TEST_F(ProgramDeathTest, ChainsAreMeasuredAndGetTheirExecutors) {
  EXPECT_EXIT(
      {
        configure(
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

/// Three nodes, two executors, groups, and callbacks that come too late for a file.
void serve_three_nodes() {
  const auto a = std::make_shared<Node>("a"), b = std::make_shared<Node>("b", "front");
  const auto c = std::make_shared<Node>("c");
  const auto group = a->create_callback_group(CallbackGroupType::Reentrant);
  SubscriptionOptions options;
  options.callback_group = group;
  const auto heard = a->create_subscription<std_msgs::msg::String>(
      "~/in", 10, [](const std_msgs::msg::String&) {}, options);
  std::vector<TimerBase::SharedPtr> timers;
  std::atomic<int> calls = 0;
  std::atomic<bool> has_c_run = false;
  const auto to_a = c->create_publisher<std_msgs::msg::String>("/a/in", 10);
  const auto of_c = c->create_wall_timer(2ms, [&] {
    to_a->publish(std_msgs::msg::String());
    has_c_run = true;
  });
  const auto count = [&] {
    if (++calls == 2) timers.push_back(c->create_wall_timer(2h, [] {}));
    if (calls >= 20 && has_c_run) rclcpp::shutdown();
  };
  const auto one = b->create_wall_timer(1ms, count), two = b->create_wall_timer(1ms, count);
  executors::MultiThreadedExecutor pool(ExecutorOptions(), 2);
  pool.add_node(a);
  pool.add_node(c);
  executors::SingleThreadedExecutor single;
  single.add_node(b);
  const Spinner spinner(pool);
  single.spin();
}

const char* const kTemplate =
    "realtime: prefer\n"
    "threads:\n"
    "  executor_1_1: {policy: SCHED_OTHER}\n"
    "  executor_1_2: {policy: SCHED_OTHER}\n"
    "  executor_2: {policy: SCHED_OTHER}\n"
    "executors:\n"
    "  executor_1: {type: multi_threaded, threads: [executor_1_1, executor_1_2]}\n"
    "  executor_2: {type: single_threaded, threads: [executor_2]}\n"
    "nodes:\n"
    "  /a:\n"
    "    executor: executor_1\n"
    "    callback_groups:\n"
    "      default: {}\n"
    "      group_1: {}\n"
    "    callbacks:\n"
    "      /a/in: {}  # in group_1: subscription, N\n"
    "  /c:\n"
    "    executor: executor_1\n"
    "    callback_groups:\n"
    "      default: {}\n"
    "    callbacks:\n"
    "      timer_2ms: {}  # in default: timer, N\n"
    "  /front/b:\n"
    "    executor: executor_2\n"
    "    callback_groups:\n"
    "      default: {}\n"
    "    callbacks:\n"
    "      timer_1ms: {}  # in default: timer, N\n"
    "      timer_1ms_2: {}  # in default: timer, N\n";

// The file of one start is valid for the next, which serves the nodes by it.
TEST_F(ProgramDeathTest, TheFirstRunWritesTheFile) {
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG_TEMPLATE", file().c_str(), 1);
        run(serve_three_nodes);
      },
      kEndsWell, "in force");
  std::ifstream written(file());
  std::string text{std::istreambuf_iterator(written), {}};
  EXPECT_EQ(text.find("# The nodes of a program"), 0u) << text;
  EXPECT_NE(text.find("#  chain_1: /c/timer_2ms -> /a/a/in\n"), std::string::npos) << text;
  text = std::regex_replace(text, std::regex("^#.*\n", std::regex::multiline), "");
  EXPECT_EQ(std::regex_replace(text, std::regex("([0-9]+ calls? |never called).*"), "N"),
            kTemplate);
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG", file().c_str(), 1);
        run(serve_three_nodes);
      },
      kEndsWell, "in force");
  takt::proves("rclcpp.md", "A file that exists is an error");
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG_TEMPLATE", file().c_str(), 1);
        run([] {});
      },
      kThrows, "robot.yaml: the file exists, and is not overwritten");
  EXPECT_EXIT(
      {
        setenv("TAKT_CONFIG_TEMPLATE", "/none/robot.yaml", 1);
        run([] {});
      },
      kThrows, "/none/robot.yaml: no file can be made there: No such file");
}

}  // namespace
}  // namespace rclcpp
