// Counts what callbacks of the layer allocate, with what they publish, once they have run a while:
// the table of docs/reference/rclcpp.md. What is 0 there stays 0.
// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <utility>

#include "takt/base/realtime_scope.hpp"
#include "takt/messages/example_interfaces/action/fibonacci.hpp"
#include "takt/messages/example_interfaces/srv/add_two_ints.hpp"
#include "takt/messages/sensor_msgs/msg/laser_scan.hpp"
#include "takt/messages/std_msgs/msg/int32.hpp"

#include "rclcpp_action/rclcpp_action.hpp"
#include "rclcpp_test.hpp"

/// A type of the user's that is sent as a number.
struct AllocatingNumber {
  int value = 0;
};
template <>
struct rclcpp::TypeAdapter<AllocatingNumber, std_msgs::msg::Int32> {
  using is_specialized = std::true_type;
  using custom_type = AllocatingNumber;
  using ros_message_type = std_msgs::msg::Int32;
  static void convert_to_ros_message(const custom_type& from, ros_message_type& to) {
    to.data = from.value;
  }
  static void convert_to_custom(const ros_message_type& from, custom_type& to) {
    to.value = from.data;
  }
};

namespace rclcpp {
namespace {

using example_interfaces::action::Fibonacci;
using example_interfaces::srv::AddTwoInts;
using sensor_msgs::msg::LaserScan;
using std_msgs::msg::Int32;
using AdaptedNumber = TypeAdapter<AllocatingNumber, Int32>;

class Allocations : public RclcppTest {
 protected:
  void SetUp() override {
    if (!takt::allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
    executor_.add_node(node_);
  }
  /// On average, of what `begin` does and of all that runs then until it has `ended`.
  double of_round(const std::function<void()>& begin, const std::function<bool()>& ended) {
    constexpr int kRounds = 100;
    std::uint64_t counted = 0;
    for (int round = 0; round < 2 * kRounds; ++round) {
      const takt::RealtimeScope scope;
      begin();
      for (int look = 0; !ended(); ++look) {
        if (look == 1000) {
          ADD_FAILURE() << "round " << round << " does not end";
          return -1;
        }
        executor_.spin_some();
      }
      if (round >= kRounds) counted += scope.so_far().allocations;
    }
    return static_cast<double>(counted) / kRounds;
  }
  /// Until the callback has run once more.
  double of_run(const std::function<void()>& begin) {
    int before = 0;
    return of_round([&] { before = runs_, begin(); }, [&] { return runs_ == before + 1; });
  }
  /// Of a message from this publisher to this callback.
  template <class M, class F>
  double of_message(const std::function<void(Publisher<M>&)>& publish, F callback) {
    const auto publisher = node_->create_publisher<M>("topic", 10);
    const auto subscription = node_->create_subscription<M>("topic", 10, std::move(callback));
    return of_run([&] { publish(*publisher); });
  }
  /// Of the same size each time, beyond what fits into the string itself.
  static LaserScan scan() {
    LaserScan message;
    message.header.frame_id = "a frame with a name of some length";
    message.ranges.resize(360);
    return message;
  }

  const Node::SharedPtr node_ = std::make_shared<Node>("node");
  int runs_ = 0;
  executors::SingleThreadedExecutor executor_;
};

TEST_F(Allocations, OfAMessageThatIsCopiedAreNoneButThoseOfAUniquePtr) {
  const auto publish = [message = scan()](Publisher<LaserScan>& publisher) {
    publisher.publish(message);
  };
  EXPECT_EQ(of_message<LaserScan>(publish, [&](const LaserScan&) { ++runs_; }), 0);
  EXPECT_EQ(of_message<LaserScan>(publish, [&](LaserScan::ConstSharedPtr) { ++runs_; }), 0);
  EXPECT_EQ(of_message<LaserScan>(publish, [&](LaserScan::SharedPtr) { ++runs_; }), 0);
  // The message, which takes both buffers with it.
  EXPECT_EQ(of_message<LaserScan>(publish, [&](LaserScan::UniquePtr) { ++runs_; }), 3);
}

TEST_F(Allocations, OfALoanAreNone) {
  const auto publish = [](Publisher<LaserScan>& publisher) {
    auto loan = publisher.borrow_loaned_message();
    loan.get().ranges.resize(360);
    publisher.publish(std::move(loan));
  };
  EXPECT_EQ(of_message<LaserScan>(publish, [&](const LaserScan&) { ++runs_; }), 0);
  EXPECT_EQ(of_message<LaserScan>(publish, [&](LaserScan::SharedPtr) { ++runs_; }), 0);
}

TEST_F(Allocations, OfAMessageOfTheUsersIsItsOwn) {
  const auto publish = [](Publisher<Int32>& publisher) {
    publisher.publish(std::make_unique<Int32>());
  };
  EXPECT_EQ(of_message<Int32>(publish, [&](const Int32&) { ++runs_; }), 1);
  EXPECT_EQ(of_message<Int32>(publish, [&](Int32::ConstSharedPtr) { ++runs_; }), 1);
  EXPECT_EQ(of_message<Int32>(publish, [&](Int32::SharedPtr) { ++runs_; }), 1);
  EXPECT_EQ(of_message<Int32>(publish, [&](Int32::UniquePtr) { ++runs_; }), 1);
}

TEST_F(Allocations, OfSeveralThatChangeTheMessageAreNone) {
  const auto publisher = node_->create_publisher<LaserScan>("topic", 10);
  int first = 0;
  const auto changes = [](int& runs) {
    return [&runs](LaserScan::SharedPtr message) {
      message->ranges[0] = 1;
      ++runs;
    };
  };
  const auto one = node_->create_subscription<LaserScan>("topic", 10, changes(first));
  const auto other = node_->create_subscription<LaserScan>("topic", 10, changes(runs_));
  EXPECT_EQ(of_run([&, message = scan()] { publisher->publish(message); }), 0);
  EXPECT_EQ(first, runs_);
}

TEST_F(Allocations, OfAnAdaptedTypeIsTheConvertedOne) {
  const auto publish = [](Publisher<AdaptedNumber>& publisher) {
    publisher.publish(AllocatingNumber{1});
  };
  EXPECT_EQ(of_message<AdaptedNumber>(publish, [&](const AllocatingNumber&) { ++runs_; }), 1);
}

TEST_F(Allocations, OfATimerAreNone) {
  const auto timer = node_->create_wall_timer(1ns, [&] { ++runs_; });
  int before = 0;
  EXPECT_EQ(of_round([&] { before = runs_; }, [&] { return runs_ > before; }), 0);
}

TEST_F(Allocations, OfACallAreNone) {
  const auto service = node_->create_service<AddTwoInts>(
      "add",
      [](const AddTwoInts::Request::SharedPtr request, AddTwoInts::Response::SharedPtr response) {
        response->sum = request->a + request->b;
      });
  const auto client = node_->create_client<AddTwoInts>("add");
  const auto request = std::make_shared<AddTwoInts::Request>();
  EXPECT_EQ(of_run([&] {
              client->async_send_request(request, [this](Client<AddTwoInts>::SharedFuture answer) {
                runs_ += answer.get() != nullptr ? 1 : 0;
              });
            }),
            0);
  std::future<AddTwoInts::Response::SharedPtr> answer;
  EXPECT_EQ(of_round([&] { answer = std::move(client->async_send_request(request).future); },
                     [&] { return answer.wait_for(0s) == std::future_status::ready; }),
            0);
}

TEST_F(Allocations, OfACallWithAHeaderThatIsAnsweredLaterAreNone) {
  std::shared_ptr<Service<AddTwoInts>> service;
  AddTwoInts::Response response;
  service = node_->create_service<AddTwoInts>(
      "add", [&](std::shared_ptr<rmw_request_id_t> id, AddTwoInts::Request::SharedPtr) {
        service->send_response(*id, response);
      });
  const auto client = node_->create_client<AddTwoInts>("add");
  const auto request = std::make_shared<AddTwoInts::Request>();
  std::future<AddTwoInts::Response::SharedPtr> answer;
  EXPECT_EQ(of_round([&] { answer = std::move(client->async_send_request(request).future); },
                     [&] { return answer.wait_for(0s) == std::future_status::ready; }),
            0);
}

TEST_F(Allocations, OfFeedbackAreThoseOfItsSequences) {
  std::shared_ptr<rclcpp_action::ServerGoalHandle<Fibonacci>> goal;
  const auto server = rclcpp_action::create_server<Fibonacci>(
      node_, "fibonacci",
      [](const rclcpp_action::GoalUUID&, std::shared_ptr<const Fibonacci::Goal>) {
        return rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE;
      },
      [](const auto&) { return rclcpp_action::CancelResponse::ACCEPT; },
      [&](auto accepted) { goal = std::move(accepted); });
  const auto client = rclcpp_action::create_client<Fibonacci>(node_, "fibonacci");
  rclcpp_action::Client<Fibonacci>::SendGoalOptions options;
  options.feedback_callback = [&](const auto&, const auto&) { ++runs_; };
  const auto handle = client->async_send_goal(Fibonacci::Goal(), options);
  ASSERT_EQ(executor_.spin_until_future_complete(handle, kLong), FutureReturnCode::SUCCESS);
  ASSERT_TRUE(spin_until(executor_, [&] { return goal != nullptr; }));
  const auto feedback = std::make_shared<Fibonacci::Feedback>();
  EXPECT_EQ(of_run([&] { goal->publish_feedback(feedback); }), 0);
  feedback->sequence.resize(3);
  EXPECT_EQ(of_run([&] { goal->publish_feedback(feedback); }), 1);  // the client's copy
  goal->succeed(std::make_shared<Fibonacci::Result>());
}

TEST_F(Allocations, OfTheTimeAreNone) {
  EXPECT_EQ(of_round(
                [&] {
                  EXPECT_GT(node_->now().nanoseconds(), 0);
                  EXPECT_GT(node_->get_clock()->now().nanoseconds(), 0);
                },
                [] { return true; }),
            0);
}

}  // namespace
}  // namespace rclcpp
