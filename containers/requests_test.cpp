// Requests to a container while code of one of its nodes does not return, or throws.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/logger.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/set_callback_parameters.hpp"
#include "takt/messages/composition_interfaces/srv/list_nodes.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_state.hpp"
#include "takt/messages/rcl_interfaces/srv/get_parameter_types.hpp"
#include "takt/messages/rcl_interfaces/srv/get_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/set_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/set_parameters_atomically.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/parameter_services.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/peer_process.hpp"

namespace takt::requests_test {
namespace {

using namespace std::chrono_literals;
using composition_interfaces::srv::ListNodes;
using composition_interfaces::srv::LoadNode;
using lifecycle_msgs::srv::ChangeState;
using lifecycle_msgs::srv::GetState;
using rcl_interfaces::srv::GetParameters;
using rcl_interfaces::srv::GetParameterTypes;
using rcl_interfaces::srv::SetParameters;
using rcl_interfaces::srv::SetParametersAtomically;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr Nanoseconds kLimit = 20s;

/// Holds threads that enter, until it is opened.
class Door {
 public:
  void enter() {
    std::unique_lock lock(mutex_);
    ++inside_;
    changed_.notify_all();
    changed_.wait_for(lock, kLimit, [this] { return is_open_; });
  }
  bool wait_for(int inside) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLimit, [&] { return inside_ >= inside; });
  }
  void open() { change(true); }
  void close() { change(false); }

 private:
  void change(bool is_open) {
    const std::lock_guard lock(mutex_);
    is_open_ = is_open;
    inside_ = 0;
    changed_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = true;
  int inside_ = 0;
};
Door door;

/// Its code returns when the door is open.
class Slow : public LifecycleNode {
 public:
  explicit Slow(const NodeOptions& options) : LifecycleNode("slow", options) {
    declare_parameter("slow", 0);
    declare_parameter("fails", 0);
    on_set_ = add_on_set_parameters_callback([](const Parameters& values) {
      if (values.contains("slow")) door.enter();
      if (values.contains("fails")) throw std::runtime_error("no light");
      return SetParametersResult();
    });
  }

 private:
  CallbackReturn on_configure(LifecycleState) override {
    door.enter();
    return CallbackReturn::SUCCESS;
  }
  OnSetParametersHandle on_set_;
};

class Requests : public testing::Test {
 protected:
  Requests() {
    door.close();
    caller_->add_node(asking_);
  }
  ~Requests() override {
    door.open();
    if (container_ == nullptr) return;
    container_->hold();
    container_->stop();
  }

  void start(bool has_dds, OnException on_exception = OnException::terminate) {
    SystemDescription system;
    system.file = "test.yaml";
    system.name = "box";
    for (const char* name : {"first", "second"}) {
      system.components.push_back(
          {.type = "takt::requests_test::Slow", .name = name, .on_exception = on_exception});
    }
    system.loads[system.components.front().container] = {.is_given = true};  // tests run as root
    system.threads.push_back({.attributes = {.name = "container"}});
    if (has_dds) {
      system.dds.emplace();
      system.dds->domain = test_domain();
      system.dds->shared_memory = SharedMemory::off;
    }
    container_ = std::make_unique<Container>(system);
    container_->start([this] {
      has_failed_ = true;
      has_failed_.notify_all();
    });
    container_->release();
  }

  template <class S>
  Future<std::optional<typename S::Response>> ask(const std::string& service,
                                                  const typename S::Request& request = {}) {
    auto client = asking_->create_client<S>(service);
    EXPECT_TRUE(client->service_is_ready()) << service;
    clients_.push_back(client);
    return client->async_send_request(request);
  }
  template <class Response>
  Response answer(const Future<std::optional<Response>>& future) {
    const auto code = caller_->spin_until_future_complete(future, kLimit);
    EXPECT_EQ(code, FutureReturnCode::SUCCESS);
    return code == FutureReturnCode::SUCCESS ? future.get().value() : Response();
  }
  std::string state(const std::string& node) {
    return answer(ask<GetState>(node + "/get_state")).current_state.label;
  }
  auto configure(const std::string& node) {
    ChangeState::Request request;
    request.transition.label = "configure";
    return ask<ChangeState>(node + "/change_state", request);
  }
  auto set(const std::string& node, const std::string& parameter) {
    SetParameters::Request request;
    request.parameters.push_back(rcl_interfaces::msg::Parameter().set__name(parameter).set__value(
        to_message(ParameterValue(std::int64_t{1}))));
    return ask<SetParameters>(node + "/set_parameters", request);
  }
  std::uint64_t id_of(const std::string& name) const {
    for (const LoadedComponent& component : container_->components()) {
      if (component.name == name) return component.id;
    }
    return 0;
  }

  const std::shared_ptr<Node> asking_ = std::make_shared<Node>("asking");
  const std::unique_ptr<Executor> caller_ = executors().make("single_threaded", {});
  std::vector<std::shared_ptr<Entity>> clients_;
  std::unique_ptr<Container> container_;
  std::atomic<bool> has_failed_{false};
};

// One thread served all requests: while a node configured, nobody was answered, and nobody could
// see that it did.
TEST_F(Requests, AreAnsweredWhileOneNodeConfigures) {
  start(/*has_dds=*/false);
  const auto configured = configure("/first");
  ASSERT_TRUE(door.wait_for(1));
  EXPECT_EQ(state("/first"), "configuring");
  EXPECT_EQ(state("/second"), "unconfigured");
  EXPECT_EQ(answer(ask<ListNodes>("/box/_container/list_nodes")).unique_ids.size(), 2u);
  LoadNode::Request load;
  load.plugin_name = "takt::requests_test::Slow";
  load.node_name = "third";
  const LoadNode::Response loaded = answer(ask<LoadNode>("/box/_container/load_node", load));
  EXPECT_TRUE(loaded.success) << loaded.error_message;
  EXPECT_EQ(state("/third"), "unconfigured");
  const auto second = configure("/second");
  EXPECT_TRUE(door.wait_for(2));  // at the same time
  EXPECT_EQ(state("/second"), "configuring");
  EXPECT_FALSE(configured.ready());
  door.open();
  EXPECT_TRUE(answer(configured).success);
  EXPECT_TRUE(answer(second).success);
  EXPECT_EQ(state("/first"), "inactive");
}

TEST_F(Requests, AreAnsweredWhileAParameterCallbackRuns) {
  start(/*has_dds=*/true);
  const auto slow = set("/first", "slow");
  ASSERT_TRUE(door.wait_for(1));
  GetParameters::Request names;
  names.names = {"slow"};
  for (const char* node : {"/first", "/second"}) {
    const auto response = answer(ask<GetParameters>(node + std::string("/get_parameters"), names));
    ASSERT_EQ(response.values.size(), 1u);
    EXPECT_EQ(response.values[0].integer_value, 0);
  }
  EXPECT_FALSE(slow.ready());
  door.open();
  EXPECT_TRUE(answer(slow).results.at(0).successful);
}

// The service went with the node, before it could answer.
TEST_F(Requests, AreAnsweredBeforeTheirNodeIsUnloaded) {
  start(/*has_dds=*/false);
  const auto configured = configure("/first");
  ASSERT_TRUE(door.wait_for(1));
  std::thread unloading([&] { container_->unload(id_of("/first"), kLimit); });
  EXPECT_TRUE(eventually([&] { return container_->components().size() < 2; }));
  EXPECT_EQ(state("/second"), "unconfigured");
  door.open();
  EXPECT_TRUE(answer(configured).success);
  unloading.join();
}

// The exception belonged to the container's own node: `on_exception` of the component was ignored.
TEST_F(Requests, ThatThrowAreAnsweredAndCountAsExceptionsOfTheNode) {
  for (const OnException policy : {OnException::ignore, OnException::terminate}) {
    start(/*has_dds=*/true, policy);
    const auto results = answer(set("/first", "fails")).results;
    ASSERT_EQ(results.size(), 1u);
    EXPECT_FALSE(results[0].successful);
    EXPECT_THAT(results[0].reason, HasSubstr("threw: no light"));
    if (policy == OnException::terminate) {
      has_failed_.wait(false);
    } else {
      EXPECT_TRUE(answer(set("/second", "none")).results.size() == 1);
      EXPECT_FALSE(has_failed_);
    }
    container_->hold();
    if (policy == OnException::terminate) {
      EXPECT_THROW(container_->stop(), std::runtime_error);
    } else {
      container_->stop();
    }
    container_.reset();
  }
}

// A request of 200,000 rules held up all others for 20 s.
TEST_F(Requests, OfMoreEntriesThanTheLimitAreRefused) {
  start(/*has_dds=*/true);
  door.open();
  const auto load = [&](std::size_t rules) {
    LoadNode::Request request;
    request.plugin_name = "takt::requests_test::Slow";
    request.node_name = fmt::format("n{}", rules);
    for (std::size_t i = 0; i < rules; ++i) {
      request.remap_rules.push_back(fmt::format("a{}:=b", i));
    }
    return answer(ask<LoadNode>("/box/_container/load_node", request));
  };
  std::vector<std::string> notes;
  Logger::instance().set_writer([&](LogLevel, std::string_view text) {
    if (text.find("remap") != std::string_view::npos) notes.emplace_back(text);
  });
  EXPECT_TRUE(load(kMostEntries).success);
  Logger::instance().set_writer({});
  // It was a line of each.
  EXPECT_THAT(notes, ElementsAre(HasSubstr("/n10000 has no topic 'a0', 'a1', 'a10' and 9997 more: "
                                           "their remap rules do nothing so far")));
  EXPECT_THAT(load(kMostEntries + 1).error_message, HasSubstr("a list of 10001 entries"));

  const auto change = [&](std::size_t callbacks) {
    SetCallbackParameters::Request request;
    request.changes = "first: {callbacks: {";
    for (std::size_t i = 0; i < callbacks; ++i) {
      request.changes += fmt::format("c{}: {{priority: 1}}, ", i);
    }
    request.changes += "}}";
    return answer(ask<SetCallbackParameters>("/box/set_callback_parameters", request)).reason;
  };
  EXPECT_THAT(change(kMostEntries / 2 - 10), HasSubstr("'c0'"));  // there is none
  EXPECT_THAT(change(kMostEntries / 2 + 10), HasSubstr("a text with"));
}

TEST_F(Requests, OfMoreParametersThanTheLimitAreRefused) {
  start(/*has_dds=*/true);
  door.open();
  const auto names = [](std::size_t count) {
    std::vector<std::string> result;
    for (std::size_t i = 0; i < count; ++i) result.push_back(fmt::format("p{}", i));
    return result;
  };
  const auto set = [&]<class S>(S, const char* service, std::size_t count) {
    typename S::Request request;
    for (std::string& name : names(count)) {
      request.parameters.push_back(rcl_interfaces::msg::Parameter()
                                       .set__name(std::move(name))
                                       .set__value(to_message(ParameterValue(std::int64_t{1}))));
    }
    return answer(ask<S>(service, request));
  };
  EXPECT_EQ(set(SetParameters(), "/first/set_parameters", kMostEntries).results.size(),
            kMostEntries);
  const auto refused = set(SetParameters(), "/first/set_parameters", kMostEntries + 1).results;
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_THAT(refused[0].reason, HasSubstr("10001"));
  const auto atomically = [&](std::size_t count) {
    return set(SetParametersAtomically(), "/first/set_parameters_atomically", count).result.reason;
  };
  EXPECT_THAT(atomically(kMostEntries), Not(HasSubstr("entries")));
  EXPECT_THAT(atomically(kMostEntries + 1), HasSubstr("10001"));

  const auto types = [&](std::size_t count) {
    GetParameterTypes::Request request;
    request.names.assign(count, "slow");
    return answer(ask<GetParameterTypes>("/first/get_parameter_types", request)).types.size();
  };
  EXPECT_EQ(types(kMostEntries), kMostEntries);
  EXPECT_EQ(types(kMostEntries + 1), 0u);
}

}  // namespace
}  // namespace takt::requests_test

TAKT_REGISTER_COMPONENT(takt::requests_test::Slow, "waits")
