// What every executor promises, asked through rclcpp: of three of them, of all with
// TAKT_STRESS_ROUNDS.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "example_interfaces/srv/add_two_ints.hpp"
#include "rclcpp_test.hpp"
#include "std_msgs/msg/int32.hpp"

namespace rclcpp {
namespace {

using example_interfaces::srv::AddTwoInts;
using std_msgs::msg::Int32;
using Pair = std::pair<std::string, std::string>;  // an executor, a scheduler

class Any : public Executor {
 public:
  explicit Any(const Pair& names) : Executor(ExecutorOptions(), names.first, options(names)) {}

 private:
  static takt::ExecutorOptions options(const Pair& names) {
    takt::ExecutorOptions options;
    options.scheduler = names.second;
    if (takt::executors().traits(names.first).pool) options.threads.resize(3);
    return options;
  }
};

std::vector<Pair> pairs() {
  if (std::getenv("TAKT_STRESS_ROUNDS") == nullptr) {
    return {{"single_threaded", "ros"}, {"multi_threaded", "edf"}, {"events", "fifo"}};
  }
  std::vector<Pair> all;
  for (const std::string& executor : takt::executors().names()) {
    // Nodes come and go here, and rclcpp knows no trigger.
    const takt::ExecutorTraits traits = takt::executors().traits(executor);
    if (traits.frozen || traits.triggered) continue;
    for (const std::string& scheduler : takt::schedulers().names()) {
      all.emplace_back(executor, scheduler);
    }
  }
  return all;
}

class Promises : public testing::TestWithParam<Pair> {
 protected:
  Promises() { rclcpp::init(0, nullptr); }
  ~Promises() override { rclcpp::shutdown(); }
  static std::shared_ptr<Node> make_node() {
    return std::make_shared<Node>("node", NodeOptions().start_parameter_services(false));
  }
  Any executor_{GetParam()};
};

TEST_P(Promises, CallbacksOfAnExclusiveGroupNeverOverlap) {
  const auto node = make_node();
  std::atomic<int> inside{0}, most{0}, calls{0};
  const auto work = [&] {
    const int now = ++inside;
    if (now > most) most = now;
    std::this_thread::yield();
    --inside;
    ++calls;
  };
  const auto timer = node->create_wall_timer(100us, work),
             other = node->create_wall_timer(70us, work);
  const auto subscription =
      node->create_subscription<Int32>("topic", 100, [&](const Int32&) { work(); });
  const auto publisher = node->create_publisher<Int32>("topic", 100);
  executor_.add_node(node);
  {
    const Spinner spinner(executor_);
    EXPECT_TRUE(takt::eventually([&] {
      publisher->publish(Int32());
      return calls > 300;
    }));
  }
  EXPECT_EQ(most, 1);
  EXPECT_GT(calls, 300);
}

TEST_P(Promises, NothingRunsAfterItsRemoval) {
  const auto node = make_node();
  executor_.add_node(node);
  const Spinner spinner(executor_);
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> calls{0};
    std::atomic<bool> is_gone{false};
    const auto count = [&] {
      EXPECT_FALSE(is_gone);
      ++calls;
    };
    TimerBase::SharedPtr timer = node->create_wall_timer(50us, count);
    Subscription<Int32>::SharedPtr subscription =
        node->create_subscription<Int32>("topic", 10, [&](Int32::UniquePtr) { count(); });
    const auto publisher = node->create_publisher<Int32>("topic", 10);
    EXPECT_TRUE(takt::eventually([&] {
      publisher->publish(Int32());
      return calls > 4;
    }));
    timer.reset();
    subscription.reset();
    is_gone = true;  // waited for what ran
    publisher->publish(Int32());
  }
}

TEST_P(Promises, ACallbackMayDropItselfAndItsNode) {
  for (int round = 0; round < 10; ++round) {
    auto node = make_node();
    std::atomic<bool> has_run{false};
    TimerBase::SharedPtr timer;
    timer = node->create_wall_timer(
        1ms,
        [&] {
          EXPECT_FALSE(has_run);
          timer.reset();
          node.reset();
          has_run = true;
        },
        nullptr, false);
    executor_.add_node(node);
    const Spinner spinner(executor_);
    timer->reset();
    EXPECT_TRUE(takt::eventually([&] { return has_run.load(); }));
  }
}

TEST_P(Promises, ANodeMovesToAnotherExecutor) {
  const auto node = make_node();
  std::atomic<int> calls{0};
  const auto timer = node->create_wall_timer(100us, [&] { ++calls; });
  Any other(GetParam());
  const Spinner first(executor_), second(other);
  for (int round = 0; round < 10; ++round) {
    Any& now = round % 2 == 0 ? executor_ : other;
    now.add_node(node);
    const int before = calls;
    EXPECT_TRUE(takt::eventually([&] { return calls > before; }));
    now.remove_node(node);
    const int after = calls;
    std::this_thread::yield();
    EXPECT_EQ(calls, after);
  }
}

TEST_P(Promises, CancelEndsOneSpinFromAnyThread) {
  const auto node = make_node();
  std::atomic<int> calls{0};
  const auto timer = node->create_wall_timer(100us, [&] { ++calls; });
  executor_.add_node(node);
  for (int round = 0; round < 10; ++round) {
    const int before = calls;
    {
      const Spinner spinner(executor_);
      EXPECT_TRUE(takt::eventually([&] { return calls > before; }));
    }
    EXPECT_FALSE(executor_.is_spinning());
    const int after = calls;
    std::this_thread::yield();
    EXPECT_EQ(calls, after);
  }
}

TEST_P(Promises, AnExceptionLeavesSpinWhichMayBeginAgain) {
  const auto node = make_node();
  int calls = 0;
  const auto timer = node->create_wall_timer(100us, [&] {
    if (++calls == 2) throw std::runtime_error("from a callback");
    if (calls >= 4) executor_.cancel();  // which another thread may notice later
  });
  executor_.add_node(node);
  EXPECT_THROW(executor_.spin(), std::runtime_error);
  EXPECT_FALSE(executor_.is_spinning());
  EXPECT_GE(calls, 2);
  executor_.spin();
  EXPECT_GE(calls, 4);
}

TEST_P(Promises, AFutureIsSpunForWhoeverCompletesIt) {
  const auto node = make_node();
  const auto group = node->create_callback_group(CallbackGroupType::Reentrant);
  const auto service = node->create_service<AddTwoInts>(
      "add",
      [](const AddTwoInts::Request::SharedPtr request, AddTwoInts::Response::SharedPtr response) {
        response->sum = request->a + request->b;
      },
      ServicesQoS(), group);
  const auto client = node->create_client<AddTwoInts>("add");
  executor_.add_node(node);
  ASSERT_TRUE(client->wait_for_service(kLong));
  for (int round = 0; round < 20; ++round) {
    auto request = std::make_shared<AddTwoInts::Request>();
    request->a = round;
    auto answer = client->async_send_request(request);
    ASSERT_EQ(executor_.spin_until_future_complete(answer, kLong), FutureReturnCode::SUCCESS);
    EXPECT_EQ(answer.get()->sum, round);
  }
  const auto of_another_thread = std::async(std::launch::async, [] { sleep_for(1ms); });
  EXPECT_EQ(executor_.spin_until_future_complete(of_another_thread, kLong),
            FutureReturnCode::SUCCESS);
  std::promise<void> promise;
  const auto never = promise.get_future();
  EXPECT_EQ(executor_.spin_until_future_complete(never, 1ms), FutureReturnCode::TIMEOUT);
  const auto ends = node->create_wall_timer(1ms, [] { rclcpp::shutdown(); });
  EXPECT_EQ(executor_.spin_until_future_complete(never, kLong), FutureReturnCode::INTERRUPTED);
}

std::string name_of(const testing::TestParamInfo<Pair>& parameter) {
  return parameter.param.first + "_" + parameter.param.second;
}
INSTANTIATE_TEST_SUITE_P(Executors, Promises, testing::ValuesIn(pairs()), name_of);

}  // namespace
}  // namespace rclcpp
