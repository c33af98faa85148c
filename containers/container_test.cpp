// A container from description to result: placement, threads, counts.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/testing/eventually.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct Tick {
  int number = 0;
};
TAKT_MESSAGE(Tick, "test/msg/Tick", number);

/// Publishes each millisecond, and receives in a group of its own.
class Ticker : public Node {
 public:
  explicit Ticker(const NodeOptions& options) : Node("ticker", options) {
    if (declare_parameter("throws", false)) throw std::runtime_error("as you wish");
    const auto group = create_callback_group("apart", CallbackGroupType::MutuallyExclusive);
    publisher_ = create_publisher<Tick>("ticks", 10, {.loans = 32});
    timer_ = create_timer("timer", 1ms,
                          [this] { publisher_->publish(publisher_->borrow_loaned_message()); });
    subscription_ = create_subscription<Tick>(
        "ticks", 10, [](const Tick&) {}, group);
  }

 private:
  std::shared_ptr<Publisher<Tick>> publisher_;
  std::shared_ptr<Timer> timer_;
  std::shared_ptr<Subscription<Tick>> subscription_;
};

SystemDescription one_ticker() {
  SystemDescription system;
  system.file = "test.yaml";
  system.components.push_back({.type = "takt::test::Ticker", .where = "test.yaml:3"});
  return system;
}

std::uint64_t pss_kb() {
  std::ifstream file("/proc/self/smaps_rollup");
  for (std::string word; file >> word;) {
    std::uint64_t kb = 0;
    if (word == "Pss:" && file >> kb) return kb;
  }
  return 0;
}

ProcessResult run(const SystemDescription& system, const ContainerOverrides& overrides = {}) {
  Container container(system, overrides);
  container.start();
  container.release();
  std::this_thread::sleep_for(100ms);
  container.hold();
  container.stop();
  return container.result();
}

/// A node of a container with an hourly timer, which publishes its own time on /clock.
class Hourly : public Node {
 public:
  explicit Hourly(const NodeOptions& options) : Node("hourly", options) {}

  /// Made by a container.
  inline static std::shared_ptr<Hourly> last;
  static SystemDescription in_a_container(Parameters parameters) {
    [[maybe_unused]] static const bool is_registered = [] {
      components().add("test::Hourly", {"hourly", [](const NodeOptions& options) {
                                          last = std::make_shared<Hourly>(options);
                                          return std::make_unique<Component>(Component{last});
                                        }});
      return true;
    }();
    SystemDescription system;
    system.threads.push_back({.attributes = {.name = "container"}});
    system.components.push_back({.type = "test::Hourly", .parameters = std::move(parameters)});
    return system;
  }

  /// Until the node has this time.
  bool set_clock(std::int32_t seconds) {
    publisher_->publish(
        rosgraph_msgs::msg::Clock().set__clock(builtin_interfaces::msg::Time().set__sec(seconds)));
    return becomes([&] { return clock().now() == TimePoint(std::chrono::seconds(seconds)); });
  }
  bool is_called(int times) {
    return becomes([&] { return calls_.load() == times; });
  }

 private:
  static bool becomes(const std::function<bool()>& condition) {
    for (int i = 0; i < 10'000 && !condition(); ++i) std::this_thread::sleep_for(1ms);
    return condition();
  }

  std::atomic<int> calls_{0};
  const std::shared_ptr<Publisher<rosgraph_msgs::msg::Clock>> publisher_ =
      create_publisher<rosgraph_msgs::msg::Clock>("/clock", 1);
  const std::shared_ptr<Timer> timer_ = create_timer("timer", 1h, [this] { ++calls_; });
};

TEST(Container, ComponentsMayUseSimulatedTime) {
  Container container(Hourly::in_a_container({{kUseSimTime, true}}));
  const std::shared_ptr<Hourly> node = std::move(Hourly::last);
  EXPECT_EQ(node->clock().now(), TimePoint{});
  container.start();
  container.release();
  EXPECT_TRUE(node->set_clock(1'000'000));  // where its time begins
  EXPECT_TRUE(node->set_clock(1'003'600));
  EXPECT_TRUE(node->is_called(1));
  EXPECT_TRUE(node->set_clock(1'014'400));  // three hours: one, and the others are missed
  EXPECT_TRUE(node->is_called(2));
  container.hold();
  container.stop();
  const auto& callbacks = container.result().callbacks;
  const auto timer = std::find_if(callbacks.begin(), callbacks.end(), [](const auto& row) {
    return row.statistics.callback == "timer";
  });
  ASSERT_NE(timer, callbacks.end());
  EXPECT_EQ(timer->statistics.received, 2u);
}

TEST(Container, ComponentsMayBeginAndEndToUseSimulatedTime) {
  Container container(Hourly::in_a_container({}));
  const std::shared_ptr<Hourly> node = std::move(Hourly::last);
  container.start();
  container.release();
  const TimePoint before = node->clock().now();
  const auto is_followed = [] {
    const std::vector<Endpoint> ends = local_topics().subscriptions;
    return std::any_of(ends.begin(), ends.end(),
                       [](const Endpoint& end) { return end.topic == "/clock"; });
  };
  for (const int round : {1, 2}) {
    EXPECT_TRUE(node->set_parameters_atomically({{kUseSimTime, true}}).successful);
    EXPECT_TRUE(is_followed());
    EXPECT_EQ(node->clock().now(), TimePoint{});
    EXPECT_TRUE(node->set_clock(1000));
    EXPECT_TRUE(node->set_clock(4600));
    EXPECT_TRUE(node->is_called(round));
    EXPECT_TRUE(node->set_parameters_atomically({{kUseSimTime, false}}).successful);
    EXPECT_GE(node->clock().now(), before);
    EXPECT_FALSE(is_followed());
  }
  container.hold();
  container.stop();
}

// `ros2 param list` asks each node of the graph, and waits for one that does not answer.
TEST(Container, EveryNodeHasItsServicesInTheGraph) {
  SystemDescription system = one_ticker();
  system.name = "robot";
  system.dds.emplace();
  system.dds->domain = test_domain();
  system.dds->shared_memory = SharedMemory::off;
  system.lifecycle.emplace();
  Container container(system);
  container.start();
  const auto observer = Participant::create({.domain = test_domain()});
  const auto owners = [&](std::string_view service) {
    std::set<std::string> found;
    for (const GraphEndpoint& end : observer->graph().services) {
      if (end.name.ends_with(service)) {
        EXPECT_EQ(end.name, fmt::format("{}{}", end.node, service));
        found.insert(end.node);
      }
    }
    return found;
  };
  const std::set<std::string> all{"/robot", "/robot_lifecycle", "/ticker"};
  EXPECT_TRUE(eventually([&] { return owners("/list_parameters") == all; }));
  EXPECT_THAT(observer->graph().nodes, testing::ElementsAreArray(all));
  const auto has_events_of = [&](const std::string& node) {
    const auto publishers = observer->graph().publishers;
    return std::any_of(publishers.begin(), publishers.end(), [&](const GraphEndpoint& end) {
      return end.name == "/parameter_events" && end.node == node;
    });
  };
  for (const std::string& node : all) EXPECT_TRUE(has_events_of(node)) << node;
  container.stop();
}

TEST(Container, DeliversEverythingUnderEveryExecutorAndAllocatesNothing) {
  for (const std::string& executor : executors().names()) {
    const ProcessResult result = run(one_ticker(), {.executor = executor});
    std::uint64_t received = 0;
    for (const auto& callback : result.callbacks) {
      EXPECT_EQ(callback.statistics.lost(), 0u) << executor;
      EXPECT_EQ(callback.statistics.dropped, 0u) << executor;
      received += callback.statistics.received;
    }
    // A timer of 1 ms and its subscription, for 100 ms: it may miss releases, and has no others.
    EXPECT_GT(received, 20u) << executor;
    const auto releases =
        static_cast<std::uint64_t>(result.threads.at(0).statistics.wall_time / 1ms) + 1;
    EXPECT_LE(received, 2 * releases) << executor;
    EXPECT_EQ(result.allocations_while_spinning, 0u) << executor;
    // It is this process, a moment ago; what its containers need comes and goes.
    EXPECT_GT(result.pss_kb, pss_kb() / 2) << executor;
    EXPECT_LT(result.pss_kb, pss_kb() * 2) << executor;
  }
}

/// Exits with 0 when the threads of this process are called so, each once.
[[noreturn]] void run_and_check_thread_names(const SystemDescription& system,
                                             const std::set<std::string>& expected) {
  Container container(system);
  container.start();
  container.release();
  std::this_thread::sleep_for(20ms);
  std::set<std::string> names;
  bool each_once = true;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(task.path() / "comm");
    std::string name;
    std::getline(file, name);
    each_once = names.insert(name).second && each_once;
  }
  container.hold();
  container.stop();
  std::_Exit(each_once && names == expected ? 0 : 1);
}

TEST(Container, EveryThreadHasANameThatTheFileCanGiveAttributes) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the thread sanitizer has a thread of its own";
#endif
  SystemDescription system = one_ticker();
  const std::vector<int> cpu{available_cpus().back()};
  for (const char* name : {"main", "log", "mine"}) {
    system.threads.push_back(
        {.attributes = {.name = name, .policy = ThreadPolicy::batch, .affinity = cpu}});
  }
  system.executors = {{.name = "only", .type = "events", .threads = {"mine"}}};
  system.components[0].executor = "only";
  // In a fresh process, because a test program has threads of its own.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(run_and_check_thread_names(system, {"main", "log", "mine"}),
              ::testing::ExitedWithCode(0), "");
}

TEST(Container, ErrorsOfConstructorsCarryTheirLine) {
  SystemDescription system = one_ticker();
  system.components[0].parameters["throws"] = true;
  try {
    Container container(system);
    FAIL() << "it was made";
  } catch (const ConfigurationError& error) {
    ASSERT_EQ(error.errors().size(), 1u);
    EXPECT_EQ(error.errors()[0],
              "test.yaml:3: component 'takt::test::Ticker' could not be made: as you wish");
  }
}

TEST(Container, NamesThatOnlyConstructorsMakeAreCheckedBeforeTheFirstCallback) {
  SystemDescription system = one_ticker();
  system.components[0].parameters["speed"] = 3.0;
  system.components[0].parameter_lines["speed"] = "test.yaml:4";
  system.components[0].remap["tocks"] = "/ticks";
  system.components[0].remap_lines["tocks"] = "test.yaml:5";
  system.components[0].callback_groups["aparte"] = {.where = "test.yaml:6"};
  try {
    Container container(system);
    FAIL() << "it was made";
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.errors(),
                ::testing::ElementsAre(
                    HasSubstr("test.yaml:4"), HasSubstr("test.yaml:5"),
                    ::testing::AllOf(HasSubstr("test.yaml:6"), HasSubstr("did you mean 'apart'"))));
  }
}

TEST(Container, DecidesTheQosOfTopicsThatAreThere) {
  SystemDescription system = one_ticker();
  system.topics["/ticks"].reliability = Reliability::best_effort;
  system.topics["/ticks"].depth = 1;
  system.topic_lines["/ticks"] = "test.yaml:5";
  system.executors = {{.name = "default", .type = "events"}};
  const ProcessResult result = run(system);
  EXPECT_EQ(result.callbacks.size(), 2u);  // a timer and a subscription
  system.topic_lines["/tiks"] = "test.yaml:6";
  try {
    Container container(system);
    FAIL() << "a topic that nobody has";
  } catch (const ConfigurationError& error) {
    EXPECT_STREQ(
        error.what(),
        "test.yaml:6: no component has the topic or service '/tiks'; did you mean '/ticks'? valid: "
        "/ticks");
  }
}

TEST(Container, AnExceptionOfACallbackEndsTheRun) {
  struct Bomb : Node {
    explicit Bomb(const NodeOptions& options) : Node("bomb", options) {}
    std::shared_ptr<Timer> timer =
        create_timer("timer", 1ms, [] { throw std::runtime_error("boom"); });
  };
  components().add("test::Bomb", {"throws", [](const NodeOptions& options) {
                                    return std::make_unique<Component>(
                                        Component{std::make_shared<Bomb>(options)});
                                  }});
  SystemDescription system;
  system.components.push_back({.type = "test::Bomb"});
  Container container(system);
  std::atomic<bool> failed{false};
  container.start([&] {
    failed = true;
    failed.notify_one();
  });
  container.release();
  failed.wait(false);
  container.hold();
  EXPECT_THROW(container.stop(), std::runtime_error);
}

TEST(Container, IsEndedByAComponentAndEndsWhatThatHasOfItsOwn) {
  struct Guard : Node {
    explicit Guard(const NodeOptions& options)
        : Node("guard", options),
          timer(create_timer("timer", 1ms, [end = options.end_container] { end(); })) {}
    std::shared_ptr<Timer> timer;
  };
  static std::atomic<int> ends{0};
  components().add("test::Guard", {"ends its container", [](const NodeOptions& options) {
                                     return std::make_unique<Component>(Component{
                                         std::make_shared<Guard>(options), [] { ++ends; }});
                                   }});
  SystemDescription system;
  system.components.push_back({.type = "test::Guard"});
  std::atomic<bool> wants_end{false};
  ContainerOverrides overrides;
  overrides.end = [&] {
    wants_end = true;
    wants_end.notify_one();
  };
  {
    Container container(system, overrides);
    container.start();
    container.release();
    wants_end.wait(false);
    container.hold();
    EXPECT_EQ(ends, 0) << "its messages are not served yet";
    container.stop();
    EXPECT_EQ(ends, 1);
  }
  EXPECT_EQ(ends, 1);
}

TEST(Container, ServesTheNodesThatAProgramMakes) {
  SystemDescription system;
  system.file = "test.yaml";
  system.components = {{.name = "ticker", .where = "test.yaml:2"},
                       {.name = "later", .where = "test.yaml:3"}};
  try {
    Container container(system);
    FAIL() << "it was made";
  } catch (const ConfigurationError& error) {
    EXPECT_EQ(error.errors().at(0),
              "test.yaml:2: node '/ticker' could not be made: a program makes it; start that with "
              "TAKT_CONFIG=test.yaml");
  }
  const auto first = std::make_shared<Ticker>(NodeOptions());
  const auto later = std::make_shared<Ticker>(NodeOptions{.name = "later"});
  std::atomic<int> heard = 0;
  const auto ends = later->create_subscription<Tick>("ticks", 10, [&](const Tick&) { ++heard; });
  bool is_there = false;
  Container container(system, {.find_node = [&](const ComponentDescription& wanted) {
                        return wanted.name == "ticker" ? first : is_there ? later : nullptr;
                      }});
  EXPECT_EQ(container.components().size(), 1u);
  container.start();
  container.release();
  is_there = true;
  container.load(system.components[1]);
  EXPECT_TRUE(eventually([&] { return heard > 3; }));
  container.cancel();
  container.join();
  EXPECT_GT(container.result().callbacks.size(), 3u);
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::Ticker, "ticks")
