// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <map>

#include "takt/messages/statistics_msgs/msg/metrics_message.hpp"
#include "takt/messages/statistics_msgs/msg/statistic_data_type.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using std_msgs::msg::String;
using Topics = RclcppTest;

String text(const std::string& data) {
  return String().set__data(data);
}

// The trap of most ports: std::bind has no operator() with fixed arguments.
class Listener : public Node {
 public:
  Listener() : Node("listener") {
    using std::placeholders::_1;
    using std::placeholders::_2;
    look_ = create_subscription<String>("topic", 10, std::bind(&Listener::look, this, _1));
    share_ = create_subscription<String>("topic", SensorDataQoS(),
                                         std::bind(&Listener::share, this, _1));
    own_ = create_subscription<String>("topic", QoS(KeepLast(5)).reliable(),
                                       std::bind(&Listener::own, this, _1));
    change_ = create_subscription<String>("topic", 10, std::bind(&Listener::change, this, _1));
    inform_ = create_subscription<String>("topic", 10, std::bind(&Listener::inform, this, _1, _2));
  }
  std::vector<std::string> heard;

 private:
  void look(const String& message) const {
    const_cast<Listener*>(this)->heard.push_back("look " + message.data);
  }
  void share(const String::ConstSharedPtr& message) { heard.push_back("share " + message->data); }
  void own(String::UniquePtr message) { heard.push_back("own " + message->data); }
  void change(String::SharedPtr message) {
    message->data += "!";
    heard.push_back("change " + message->data);
  }
  void inform(String::ConstSharedPtr message, const MessageInfo& info) {
    heard.push_back("inform " + message->data +
                    (info.get_rmw_message_info().from_intra_process ? "" : " from outside"));
  }
  Subscription<String>::SharedPtr look_, share_, own_, change_, inform_;
};

TEST_F(Topics, MemberFunctionsOfEveryFormAreBound) {
  const auto listener = std::make_shared<Listener>();
  const auto publisher = listener->create_publisher<String>("topic", 10);
  executors::SingleThreadedExecutor executor;
  executor.add_node(listener);
  publisher->publish(text("a"));
  ASSERT_TRUE(spin_until(executor, [&] { return listener->heard.size() == 5; }));
  const std::set<std::string> heard(listener->heard.begin(), listener->heard.end());
  EXPECT_EQ(heard, (std::set<std::string>{"look a", "share a", "own a", "change a!", "inform a"}));
}

TEST_F(Topics, ALoneOwnerGetsThePublishedMessageItself) {
  const auto node = std::make_shared<Node>("node", NodeOptions().use_intra_process_comms(true));
  const String* received = nullptr;
  const auto subscription = node->create_subscription<String>(
      "topic", 10, [&](String::UniquePtr message) { received = message.get(); });
  const auto publisher = node->create_publisher<String>("topic", 10);
  auto message = std::make_unique<String>();
  const String* const sent = message.get();
  publisher->publish(std::move(message));
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  ASSERT_TRUE(spin_until(executor, [&] { return received != nullptr; }));
  EXPECT_EQ(received, sent);
}

TEST_F(Topics, NamesAreExpandedAndRemapped) {
  const auto node = std::make_shared<Node>(
      "camera", "/front",
      NodeOptions().arguments({"--ros-args", "-r", "image:=picture", "-r", "__node:=eye"}));
  EXPECT_STREQ(node->get_fully_qualified_name(), "/front/eye");
  EXPECT_STREQ(node->create_publisher<String>("image", 1)->get_topic_name(), "/front/picture");
  EXPECT_STREQ(node->create_publisher<String>("~/image", 1)->get_topic_name(), "/front/eye/image");
  EXPECT_STREQ(node->create_publisher<String>("/{node}", 1)->get_topic_name(), "/eye");
  EXPECT_STREQ(node->create_sub_node("left")->create_publisher<String>("raw", 1)->get_topic_name(),
               "/front/left/raw");
  EXPECT_THROW(node->create_publisher<String>("no name", 1), exceptions::InvalidTopicNameError);
  EXPECT_THROW(std::make_shared<Node>("no name"), exceptions::InvalidNodeNameError);
}

TEST_F(Topics, MessagesAreTakenWithoutAnExecutor) {
  const auto node = std::make_shared<Node>("node");
  SubscriptionOptions options;
  options.callback_group = node->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  const auto subscription = node->create_subscription<String>(
      "topic", 10, [](const String&) { FAIL(); }, options);
  const auto publisher = node->create_publisher<String>("topic", 10);
  WaitSet wait_set({{subscription}});
  EXPECT_EQ(wait_set.wait(0s).kind(), WaitResultKind::Timeout);
  publisher->publish(text("a"));
  const auto result = wait_set.wait(kLong);
  ASSERT_EQ(result.kind(), WaitResultKind::Ready);
  EXPECT_NE(result.get_wait_set().get_rcl_wait_set().subscriptions[0], nullptr);
  String message;
  MessageInfo info;
  ASSERT_TRUE(subscription->take(message, info));
  EXPECT_EQ(message.data, "a");
  EXPECT_FALSE(subscription->take(message, info));
}

TEST_F(Topics, ATriggerEndsOneWait) {
  const auto triggered = std::make_shared<GuardCondition>();
  WaitSet wait_set({}, {triggered});
  triggered->trigger();
  EXPECT_EQ(wait_set.wait(kLong).kind(), WaitResultKind::Ready);
  EXPECT_EQ(wait_set.wait(0s).kind(), WaitResultKind::Timeout);
}

// What was added while a thread waited did not wake it, however ready it was.
TEST_F(Topics, AThreadWaitsForWhatIsAddedMeanwhile) {
  const auto node = std::make_shared<Node>("node");
  const auto group = node->create_callback_group(CallbackGroupType::Reentrant, false);
  const auto kept = std::make_shared<GuardCondition>();
  const auto triggered = std::make_shared<GuardCondition>();
  triggered->trigger();
  const auto timer = node->create_wall_timer(
      1ms, [] {}, group);
  for (int i = 0; i < 2; ++i) {
    ThreadSafeWaitSet set({}, {kept});
    // Longer than the test waits: at its end it finds what is ready by looking.
    auto waits = std::async(std::launch::async, [&] { return set.wait(1h).kind(); });
    EXPECT_EQ(waits.wait_for(10ms), std::future_status::timeout);
    if (i == 0) {
      set.add_guard_condition(triggered);
    } else {
      set.add_timer(timer);
    }
    if (waits.wait_for(kLong) != std::future_status::ready) std::abort();
    EXPECT_EQ(waits.get(), WaitResultKind::Ready);
    EXPECT_THROW(set.add_guard_condition(kept), std::runtime_error);
    set.remove_guard_condition(kept);
    EXPECT_THROW(set.remove_guard_condition(kept), std::runtime_error);
  }
}

TEST_F(Topics, AMessageIsWaitedFor) {
  const auto node = std::make_shared<Node>("node");
  String message;
  EXPECT_FALSE(wait_for_message(message, node, "topic", 1ms));
  const auto publisher = node->create_publisher<String>("topic", QoS(1).transient_local());
  publisher->publish(text("a"));
  ASSERT_TRUE(wait_for_message(message, node, "topic", kLong, QoS(1).transient_local()));
  EXPECT_EQ(message.data, "a");
}

// Programs give callbacks for all events, whatever their QoS: Takt refused one for a deadline that
// nothing has.
TEST_F(Topics, CallbacksAreGivenForEventsThatNeverCome) {
  const auto node = std::make_shared<Node>("node");
  PublisherOptions offered;
  offered.event_callbacks.deadline_callback = [](QOSDeadlineOfferedInfo&) { FAIL(); };
  offered.event_callbacks.liveliness_callback = [](QOSLivelinessLostInfo&) { FAIL(); };
  const auto publisher = node->create_publisher<String>("topic", 1, offered);
  SubscriptionOptions asked;
  asked.event_callbacks.deadline_callback = [](QOSDeadlineRequestedInfo&) { FAIL(); };
  const auto subscription = node->create_subscription<String>(
      "topic", 1, [](const String&) {}, asked);
  publisher->publish(text("a"));
  spin_some(node);
}

// A publisher that has to assert its liveliness, and does not, gets one callback until it does.
TEST_F(Topics, LivelinessIsLostOnceUntilItIsAsserted) {
  const auto node = std::make_shared<Node>("node");
  int lost = 0;
  PublisherOptions options;
  options.event_callbacks.liveliness_callback = [&](QOSLivelinessLostInfo& info) {
    EXPECT_EQ(info.total_count, ++lost);
  };
  const auto manual = QoS(1).liveliness(LivelinessPolicy::ManualByTopic);
  const auto publisher =
      node->create_publisher<String>("topic", QoS(manual).liveliness_lease_duration(4ms), options);
  const auto patient = node->create_publisher<String>(
      "topic", QoS(manual).liveliness_lease_duration(kLong), options);
  const auto automatic =
      node->create_publisher<String>("topic", QoS(1).liveliness_lease_duration(4ms), options);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  EXPECT_TRUE(spin_until(executor, [&] { return lost == 1; }));
  for (int i = 0; i < 3; ++i) executor.spin_once(4ms);
  EXPECT_EQ(lost, 1);
  publisher->assert_liveliness();
  EXPECT_TRUE(spin_until(executor, [&] { return lost == 2; }));
}

// The options were accepted, and nothing was published; and a message of this process had no time.
TEST_F(Topics, AgeAndPeriodOfMessagesArePublished) {
  using statistics_msgs::msg::MetricsMessage;
  using Type = statistics_msgs::msg::StatisticDataType;
  const auto node = std::make_shared<Node>("node");
  SubscriptionOptions options;
  options.topic_stats_options.state = TopicStatisticsState::Enable;
  options.topic_stats_options.publish_period = 20ms;
  const auto measured = node->create_subscription<String>(
      "topic", 10,
      [](String::UniquePtr, const MessageInfo& info) {
        EXPECT_NE(info.get_rmw_message_info().source_timestamp, 0);
      },
      options);
  std::map<std::string, std::map<int, double>> found;
  const auto statistics = node->create_subscription<MetricsMessage>(
      "/statistics", 10, [&](const MetricsMessage& message) {
        EXPECT_EQ(message.measurement_source_name, "node");
        EXPECT_EQ(message.unit, "ms");
        EXPECT_GT(Time(message.window_stop), Time(message.window_start));
        std::map<int, double> values;
        for (const auto& point : message.statistics) values[point.data_type] = point.data;
        ASSERT_EQ(values.size(), 5u);
        const double count = values[Type::STATISTICS_DATA_TYPE_SAMPLE_COUNT];
        const double average = values[Type::STATISTICS_DATA_TYPE_AVERAGE];
        EXPECT_EQ(count == 0, std::isnan(average));
        if (count == 2) found[message.metrics_source] = values;  // then its deviation is known
      });
  const auto publisher = node->create_publisher<String>("topic", 10);
  const auto timer = node->create_wall_timer(9ms, [&] { publisher->publish(text("a")); });
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  ASSERT_TRUE(spin_until(executor, [&] { return found.size() == 2; }));
  for (const char* const name : {"message_age", "message_period"}) {
    auto& values = found[name];
    EXPECT_GE(values[Type::STATISTICS_DATA_TYPE_MINIMUM], 0) << name;
    EXPECT_LE(values[Type::STATISTICS_DATA_TYPE_MINIMUM],
              values[Type::STATISTICS_DATA_TYPE_AVERAGE]);
    EXPECT_LE(values[Type::STATISTICS_DATA_TYPE_AVERAGE],
              values[Type::STATISTICS_DATA_TYPE_MAXIMUM]);
    const double range =
        values[Type::STATISTICS_DATA_TYPE_MAXIMUM] - values[Type::STATISTICS_DATA_TYPE_MINIMUM];
    EXPECT_NEAR(values[Type::STATISTICS_DATA_TYPE_STDDEV], range / 2, 1e-6) << name;
  }
  options.topic_stats_options.publish_period = 0ms;
  const auto refused = [&] {
    return node->create_subscription<String>(
        "topic", 10, [](const String&) {}, options);
  };
  EXPECT_THROW(refused(), std::invalid_argument);
}

TEST_F(Topics, SerializedMessagesComeAndGo) {
  const auto node = std::make_shared<Node>("node");
  std::string received;
  const auto subscription =
      node->create_subscription<String>("topic", 10, [&](std::shared_ptr<SerializedMessage> bytes) {
        String message;
        Serialization<String>().deserialize_message(bytes.get(), &message);
        received = message.data;
      });
  SerializedMessage bytes;
  const String message = text("a");
  Serialization<String>().serialize_message(&message, &bytes);
  node->create_publisher<String>("topic", 10)->publish(bytes);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  ASSERT_TRUE(spin_until(executor, [&] { return !received.empty(); }));
  EXPECT_EQ(received, "a");
}

}  // namespace
}  // namespace rclcpp
