// Components written for rclcpp in a container of Takt: whose context they are in, and how it ends.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <atomic>
#include <thread>

#include "rclcpp_components/register_node_macro.hpp"
#include "rclcpp_test.hpp"
#include "std_msgs/msg/string.hpp"

namespace rclcpp {
namespace {

using std_msgs::msg::String;

/// Shuts down in a callback.
class Ending : public Node {
 public:
  explicit Ending(const NodeOptions& options) : Node("ending", options) {
    timer_ = create_wall_timer(1ms, [] { rclcpp::shutdown(); });
  }

 private:
  TimerBase::SharedPtr timer_;
};

class Initializing : public Node {
 public:
  explicit Initializing(const NodeOptions& options) : Node("initializing", options) {
    EXPECT_TRUE(rclcpp::ok());
    EXPECT_THROW(rclcpp::init(0, nullptr), ContextAlreadyInitialized);
    EXPECT_FALSE(rclcpp::signal_handlers_installed());
  }
};

/// Has a node, an executor and a thread of its own, which only the end of the context ends.
class Spinning : public Node {
 public:
  explicit Spinning(const NodeOptions& options)
      : Node("spinning", options), inner_(std::make_shared<Node>("inner")) {
    subscription_ =
        inner_->create_subscription<String>("talk", 10, [](const String&) { heard.fetch_add(1); });
    publisher_ = create_publisher<String>("talk", 10);
    timer_ = create_wall_timer(1ms, [this] { publisher_->publish(String()); });
    executor_.add_node(inner_);
    thread_ = std::thread([this] { executor_.spin(); });
  }
  ~Spinning() override { thread_.join(); }

  inline static std::atomic<int> heard{0};

 private:
  std::shared_ptr<Node> inner_;
  Subscription<String>::SharedPtr subscription_;
  Publisher<String>::SharedPtr publisher_;
  TimerBase::SharedPtr timer_;
  executors::SingleThreadedExecutor executor_;
  std::thread thread_;
};

takt::SystemDescription system_of(std::vector<std::string> types) {
  takt::SystemDescription system;
  system.file = "test.yaml";
  for (auto& type : types) system.components.push_back({.type = std::move(type)});
  return system;
}

TEST(ComponentInAContainer, EndsItByShutdown) {
  std::atomic<int> ends{0};
  takt::ContainerOverrides overrides;
  overrides.end = [&] { ends.fetch_add(1); };
  takt::Container container(system_of({"rclcpp::Ending"}), overrides);
  EXPECT_TRUE(rclcpp::ok());
  container.start();
  container.release();
  EXPECT_TRUE(takt::eventually([&] { return ends.load() != 0; }));
  EXPECT_FALSE(rclcpp::ok());
  container.hold();
  container.stop();
  EXPECT_EQ(ends, 1);
}

TEST(ComponentInAContainer, FindsItsContextInitialised) {
  const takt::Container container(system_of({"rclcpp::Initializing"}));
}

TEST(ComponentInAContainer, SpinsNodesOfItsOwnUntilTheEnd) {
  for (int round = 0; round < 2; ++round) {  // another container begins anew
    Spinning::heard = 0;
    takt::Container container(system_of({"rclcpp::Spinning"}));
    container.start();
    container.release();
    EXPECT_TRUE(takt::eventually([] { return Spinning::heard.load() > 2; }));
    container.hold();
    container.stop();
    EXPECT_FALSE(rclcpp::ok());
  }
}

// What a component has begun ends also where nothing was started.
TEST(ComponentInAContainer, EndsWithAContainerThatNeverStarted) {
  { const takt::Container container(system_of({"rclcpp::Spinning"})); }
  EXPECT_FALSE(rclcpp::ok());
  EXPECT_NO_THROW(rclcpp::init(0, nullptr));
  EXPECT_TRUE(rclcpp::shutdown());
}

}  // namespace
}  // namespace rclcpp

RCLCPP_COMPONENTS_REGISTER_NODE(rclcpp::Ending)
RCLCPP_COMPONENTS_REGISTER_NODE(rclcpp::Initializing)
RCLCPP_COMPONENTS_REGISTER_NODE(rclcpp::Spinning)
