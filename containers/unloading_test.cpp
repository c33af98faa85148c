// What components do before they go.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/container.hpp"
#include "takt/messages/composition_interfaces/srv/unload_node.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using composition_interfaces::srv::UnloadNode;
using lifecycle_msgs::srv::ChangeState;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

/// What the components below have done, as "NAME WHAT".
class Journal {
 public:
  /// What begins with one of these names waits when it has written.
  void clear(std::set<std::string> blocked = {}) {
    change([&] { entries_.clear(), blocked_ = std::move(blocked); });
  }
  void open(const std::string& name) {
    change([&] { blocked_.erase(name); });
  }
  void write(const std::string& name, const std::string& what) {
    change([&] { entries_.push_back(name + " " + what); });
    wait([&] { return !blocked_.contains(name); });
  }
  bool wait_for(const std::string& entry, Nanoseconds most = 30s) {
    return wait(
        [&] { return std::find(entries_.begin(), entries_.end(), entry) != entries_.end(); }, most);
  }
  std::vector<std::string> entries(const std::string& ending = "") {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> result = entries_;
    std::erase_if(result, [&](const auto& entry) { return !entry.ends_with(ending); });
    return result;
  }

 private:
  void change(const std::function<void()>& change_it) {
    {
      const std::lock_guard lock(mutex_);
      change_it();
    }
    changed_.notify_all();
  }
  bool wait(const std::function<bool()>& condition, Nanoseconds most = 30s) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, most, condition);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> entries_;
  std::set<std::string> blocked_;
};
Journal journal;

class Writer : public LifecycleNode, public Completing {
 public:
  explicit Writer(const NodeOptions& options) : LifecycleNode("writer", options) {}
  std::string complete() override {
    write("complete");
    return "";
  }

 private:
  void write(const std::string& what) { journal.write(std::string(name()), what); }
  CallbackReturn done(const std::string& what) {
    write(what);
    return CallbackReturn::SUCCESS;
  }
  CallbackReturn on_configure(LifecycleState) override { return done("configure"); }
  CallbackReturn on_deactivate(LifecycleState) override { return done("deactivate"); }
  CallbackReturn on_shutdown(LifecycleState) override { return done("shutdown"); }
};

class Counted : public Node, public Completing {
 public:
  explicit Counted(const NodeOptions& options) : Node("counted", options) {}
  std::string complete() override {
    journal.write(std::string(name()), "complete");
    return "";
  }
  ~Counted() override { journal.write(std::string(name()), "gone"); }
};

class Unloading : public testing::Test {
 protected:
  void start() {
    SystemDescription system;
    system.file = "test.yaml";
    system.name = "box";
    system.executors = {{.name = "default", .type = "events"}};
    system.threads.push_back({.attributes = {.name = "container"}});
    container_ = std::make_unique<Container>(system);
    container_->start();
    container_->release();
  }
  void end() {
    container_->hold();
    container_->stop();
    container_.reset();
  }
  std::uint64_t load(const std::string& name, const std::string& type = "takt::test::Writer") {
    return container_->load({.type = type, .name = name}).id;
  }
  void expect_timeout(std::uint64_t id) {
    try {
      container_->unload(id, 1ms);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("after 1ms"));
    }
  }
  /// Whether the service of the component "it" says that the transition has succeeded.
  static bool asks_for(const char* transition) {
    ChangeState::Request request;
    request.transition.label = transition;
    return succeeds<ChangeState>("/it/change_state", request);
  }
  template <class S>
  static bool succeeds(const char* service, const typename S::Request& request) {
    const auto node = std::make_shared<Node>("asking");
    const auto client = node->create_client<S>(service);
    const auto executor = executors().make("events", {});
    executor->add_node(node);
    const auto answer = client->async_send_request(request);
    executor->spin_until_future_complete(answer, 30s);
    return answer.ready() && answer.get() && answer.get()->success;
  }

  std::unique_ptr<Container> container_;
};

// stop() read the list of components without its lock, as all executors had ended. The thread of an
// unload that had timed out completed its component at the same time, and took it from the list: a
// null pointer was followed, or the next component was not completed.
TEST_F(Unloading, DuringAStopCompletesEachComponentOnce) {
  journal.clear({"a", "b"});
  start();
  const auto load_counted = [&](const char* name) { return load(name, "takt::test::Counted"); };
  load_counted("a");
  const std::uint64_t leaving = load_counted("b");
  load_counted("c");
  expect_timeout(leaving);
  EXPECT_TRUE(journal.wait_for("b complete"));
  std::thread opener([] {
    EXPECT_TRUE(journal.wait_for("a complete"));
    journal.open("b");
    journal.wait_for("b gone", 300ms);  // from the list it is read from, at worst
    journal.open("a");
  });
  end();
  opener.join();
  EXPECT_THAT(journal.entries(" complete"),
              UnorderedElementsAre("a complete", "b complete", "c complete"));
}

// It returned while the component lived on in what another thread looked at.
TEST_F(Unloading, WaitsForThoseThatLookAtTheContainer) {
  journal.clear();
  start();
  const std::uint64_t id = load("it", "takt::test::Counted");
  std::optional<Plan> look = container_->plan();
  auto unload = std::async(std::launch::async, [&] { container_->unload(id, 30s); });
  EXPECT_TRUE(journal.wait_for("it complete"));
  EXPECT_EQ(unload.wait_for(10ms), std::future_status::timeout);
  const Plan later = container_->plan();  // which does not have it
  look.reset();
  unload.get();
  EXPECT_EQ(journal.entries().back(), "it gone");
  end();
}

// An active node was destroyed as it was, without on_deactivate and on_shutdown.
TEST_F(Unloading, AndTheEndOfARunBringALifecycleNodeDown) {
  for (const bool is_unloaded : {true, false}) {
    journal.clear();
    start();
    const std::uint64_t id = load("it");
    EXPECT_TRUE(asks_for("configure"));
    EXPECT_TRUE(asks_for("activate"));
    if (is_unloaded) {
      UnloadNode::Request request;
      request.unique_id = id;
      EXPECT_TRUE(succeeds<UnloadNode>("/box/_container/unload_node", request));
    }
    end();
    EXPECT_THAT(journal.entries(),
                ElementsAre("it configure", "it deactivate", "it shutdown", "it complete"));
  }
}

// The client of a transition learns how it ends, though the node is unloaded meanwhile.
TEST_F(Unloading, WaitsForATransitionAndItsResponse) {
  journal.clear({"it"});
  start();
  const std::uint64_t id = load("it");
  std::thread unloader([&] {
    EXPECT_TRUE(journal.wait_for("it configure"));
    expect_timeout(id);
    journal.open("it");
  });
  EXPECT_TRUE(asks_for("configure"));
  unloader.join();
  EXPECT_TRUE(journal.wait_for("it complete"));
  EXPECT_THAT(journal.entries(), ElementsAre("it configure", "it shutdown", "it complete"));
  end();
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::Counted)
TAKT_REGISTER_COMPONENT(takt::test::Writer)
