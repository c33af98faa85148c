// Two libraries of components that export nothing, for visibility_test.cpp: that of the talker
// brings a scheduler and an executor too, and that of the listener uses them.
// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "takt/containers/component.hpp"
#include "takt/containers/visibility_test.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/sched/scheduler.hpp"

namespace hidden {

#ifdef TAKT_TEST_TALKER

struct LastCome {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return a.sequence > b.sequence;
  }
};

class Talker : public takt::Node {
 public:
  explicit Talker(const takt::NodeOptions& options) : Node("talker", options) {
    timer_ = create_timer("tick", std::chrono::milliseconds(1), [this] {
      publisher_->publish(Reading{42, "degrees"});
    });
  }

 private:
  std::shared_ptr<takt::Publisher<Reading>> publisher_ = create_publisher<Reading>("reading", 10);
  std::shared_ptr<takt::Timer> timer_;
};

struct NoCamera : takt::Error {
  using Error::Error;
};

class Refuser : public takt::Node {
 public:
  explicit Refuser(const takt::NodeOptions& options) : Node("refuser", options) {
    throw NoCamera("no camera");
  }
};

#else

/// The order in which the scheduler of the other library serves two callbacks.
std::string order() {
  const auto executor = takt::executors().make("of_the_talker", {});
  const auto node = std::make_shared<takt::Node>("ordered");
  std::string result;
  const auto a = node->create_guard_condition("a", [&] { result += "a"; });
  const auto b = node->create_guard_condition("b", [&] { result += "b"; });
  executor->add_node(node);
  a->trigger();
  b->trigger();
  executor->spin_some();
  return result;
}

/// Catches an error of Takt's library by its type, although this library exports nothing.
std::string error() {
  try {
    takt::schedulers().make("of_nobody", {});
  } catch (const takt::Error& error) {
    return error.what();
  }
  return "no error";
}

class Listener : public takt::LifecycleNode {
 public:
  explicit Listener(const takt::NodeOptions& options) : LifecycleNode("listener", options) {
    subscription_ =
        Node::create_subscription<Reading>("reading", 10, [this](const Reading& reading) {
          publisher_->publish(Answer{std::to_string(reading.number) + " " + reading.unit + ", " +
                                     order() + ", " + error()});
        });
  }

 private:
  std::shared_ptr<takt::Publisher<Answer>> publisher_ =
      Node::create_publisher<Answer>("answer", 10);
  std::shared_ptr<takt::Subscription<Reading>> subscription_;
};

#endif

}  // namespace hidden

#ifdef TAKT_TEST_TALKER
TAKT_REGISTER_SCHEDULER("of_the_talker", "last come, first served",
                        takt::HeapScheduler<hidden::LastCome>)
TAKT_REGISTER_EXECUTOR("of_the_talker", "for tests", .scheduler = "of_the_talker")
TAKT_REGISTER_COMPONENT(hidden::Talker)
TAKT_REGISTER_COMPONENT(hidden::Refuser)
#else
TAKT_REGISTER_COMPONENT(hidden::Listener)
#endif
