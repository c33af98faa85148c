// A robot whose callbacks the tests of modes observe, and its file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODES_TEST_HPP_
#define TAKT_CONTAINERS_MODES_TEST_HPP_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/set_mode.hpp"
#include "takt/entities/task.hpp"

namespace takt::modes_test {

using namespace std::chrono_literals;

struct Image {
  int number = 0;
};
TAKT_MESSAGE(Image, "test/msg/ModesImage", number);

/// What the callbacks of the robot do, and what they have done.
struct World {
  ManualClock clock;
  std::vector<std::string> ran;
  std::function<void(const std::string&)> in_callback = [](const std::string&) {};

  void run(const std::string& name) {
    ran.push_back(fmt::format("{}@{}", name, clock.now().time_since_epoch() / 1ms));
    in_callback(name);
  }
  std::vector<std::string> take() { return std::exchange(ran, {}); }
};
inline World* world = nullptr;

/// Three timers of 10 ms, and a subscription.
class Robot : public Node {
 public:
  explicit Robot(const NodeOptions& options)
      : Node("robot", options), request_mode(options.request_mode) {
    last = this;
  }
  void make_plan_again() {
    plan = nullptr;
    plan = create_timer("plan", 10ms, [] { world->run("plan"); });
  }
  static inline Robot* last = nullptr;
  const std::function<bool(std::string_view)> request_mode;
  const Timer::SharedPtr log = create_timer("log", 10ms, [] { world->run("log"); });
  Timer::SharedPtr plan = create_timer("plan", 10ms, [] { world->run("plan"); });
  const Timer::SharedPtr loop = create_timer("loop", 10ms, [] { world->run("loop"); });
  const std::shared_ptr<Subscription<Image>> image =
      create_subscription<Image>("image", 10, [](const Image&) { world->run("image"); });
  const std::shared_ptr<Service<SetMode>> service =
      create_service<SetMode>("ask", [](const auto&, auto&) {});
};

/// Works in three batches of 2 ms.
class Worker : public Node {
 public:
  explicit Worker(const NodeOptions& options) : Node("worker", options) {
    work_ = create_timer("work", 10ms, []() -> Task<> {
      for (const char* batch : {"first", "second", "third"}) {
        world->run(batch);
        world->clock.work(2ms);
        co_await takt::batch();
      }
      world->run("end");
    });
  }

 private:
  Timer::SharedPtr work_;
};

template <class T>
void provide(const std::string& type) {
  try {
    components().check(type);
  } catch (const Error&) {
    components().add(type,
                     {"for tests", [](const NodeOptions& options) {
                        return std::make_unique<Component>(Component{std::make_shared<T>(options)});
                      }});
  }
}

inline constexpr const char* kModes = R"(modes:
  degraded: {drop: [robot/image], demote: [robot/plan], on: {overrun: robot/loop}}
  safe: {drop: [robot/plan, robot/log]}
)";

inline std::string file_of(
    const std::string& modes, const std::string& more = "",
    const std::string& executor = "type: events, scheduler: fixed_priority") {
  provide<Robot>("test::ModesRobot");
  provide<Worker>("test::ModesWorker");
  return "executors: {default: {" + executor + "}}\n" + modes + R"(container:
  name: box
  components:
    - component: test::ModesRobot
      name: robot
      callbacks: {loop: {priority: 3, budget: 2ms}, plan: {priority: 2}, log: {priority: 1}}
)" + more;
}

inline SystemDescription system_of(const std::string& text) {
  return ConfigurationFile("system.yaml", text).read();
}

}  // namespace takt::modes_test

#endif  // TAKT_CONTAINERS_MODES_TEST_HPP_
