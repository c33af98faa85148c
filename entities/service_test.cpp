// Tests of services and clients: in the process, and between two participants.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/service.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/testing/serve.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

void add(const Add::Request& request, Add::Response& response) {
  response.sum = request.a + request.b;
}

class ServiceTest : public testing::Test {
 protected:
  ManualClock clock_;
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
};

TEST_F(ServiceTest, AnswersACallIntoItsFuture) {
  const auto service = node_->create_service<Add>("add", add);
  const auto client = node_->create_client<Add>("add");
  EXPECT_TRUE(client->service_is_ready());
  const auto future = client->async_send_request({.a = 2, .b = 3});
  EXPECT_EQ(client->calls_in_flight(), 1u);
  EXPECT_TRUE(serve(*service));
  EXPECT_TRUE(serve(*client));
  ASSERT_TRUE(future.ready());
  EXPECT_EQ(future.get()->sum, 5);
  EXPECT_EQ(client->calls_in_flight(), 0u);
}

TEST_F(ServiceTest, GivesEachClientItsOwnAnswersOnly) {
  const auto service = node_->create_service<Add>("add", add);
  const auto one = node_->create_client<Add>("add");
  const auto other = node_->create_client<Add>("add");
  std::vector<std::int64_t> sums;
  one->async_send_request({.a = 1, .b = 1},
                          [&](const auto* answer) { sums.push_back(answer->sum); });
  one->async_send_request({.a = 2, .b = 2},
                          [&](const auto* answer) { sums.push_back(answer->sum); });
  while (serve(*service)) {
  }
  EXPECT_EQ(other->ready_count(), 0u);
  while (serve(*one)) {
  }
  EXPECT_THAT(sums, ElementsAre(2, 4));
}

TEST_F(ServiceTest, IsNotReadyWithoutAService) {
  const auto client = node_->create_client<Add>("add");
  EXPECT_FALSE(client->service_is_ready());
  {
    const auto service = node_->create_service<Add>("add", add);
    EXPECT_TRUE(client->service_is_ready());
  }
  EXPECT_FALSE(client->service_is_ready());
}

TEST_F(ServiceTest, RefusesMoreCallsThanTheClientsBound) {
  const auto client = node_->create_client<Add>("add", {.calls_in_flight = 2});
  client->async_send_request({});
  client->async_send_request({});
  EXPECT_THAT([&] { client->async_send_request({}); },
              ThrowsMessage<Error>(HasSubstr("'/add': 2 calls wait for their answers already")));
  EXPECT_EQ(client->calls_in_flight(), 2u);
}

TEST_F(ServiceTest, EndsCallsWithoutAnswerWhenTheirTimeIsUp) {
  const auto client = node_->create_client<Add>("add", {.timeout = 10ms});
  const auto timer = node_->entities().front();
  ASSERT_EQ(timer->name(), "add_timeout");
  EXPECT_EQ(timer->next_release(), kNever);
  const auto first = client->async_send_request({});
  const TimePoint begin = clock_.now();
  clock_.advance(4ms);
  const auto second = client->async_send_request({});
  EXPECT_EQ(timer->next_release(), begin + 10ms);
  clock_.advance(6ms);
  EXPECT_TRUE(serve(*timer));
  ASSERT_TRUE(first.ready());
  EXPECT_FALSE(first.get().has_value());
  EXPECT_FALSE(second.ready());
  EXPECT_EQ(timer->next_release(), begin + 14ms);
  clock_.advance(4ms);
  EXPECT_TRUE(serve(*timer));
  EXPECT_TRUE(second.ready());
  EXPECT_EQ(timer->next_release(), kNever);
}

TEST_F(ServiceTest, IgnoresAnAnswerThatComesTooLate) {
  const auto service = node_->create_service<Add>("add", add);
  const auto client = node_->create_client<Add>("add", {.timeout = 10ms});
  int answers = 0, failures = 0;
  client->async_send_request(
      {}, [&](const auto* answer) { ++(answer != nullptr ? answers : failures); });
  clock_.advance(10ms);
  for (const auto& entity : node_->entities()) {
    if (entity->kind() == EntityKind::timer) {
      EXPECT_TRUE(serve(*entity));
    }
  }
  while (serve(*service)) {
  }
  while (serve(*client)) {
  }
  EXPECT_EQ(answers, 0);
  EXPECT_EQ(failures, 1);
}

TEST_F(ServiceTest, GivesTheCallbackAnEmptyResponseEachTime) {
  std::vector<std::int64_t> seen;
  const auto service =
      node_->create_service<Add>("add", [&](const Add::Request& request, Add::Response& response) {
        seen.push_back(response.sum);
        response.sum = request.a;
      });
  const auto client = node_->create_client<Add>("add");
  for (int call = 1; call <= 2 * static_cast<int>(kServiceDepth); ++call) {
    client->async_send_request({.a = call}, [](const auto*) {});
    serve(*service);
    serve(*client);
  }
  EXPECT_THAT(seen, testing::Each(0));
}

TEST_F(ServiceTest, CallsInTheProcessAllocateNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto service = node_->create_service<Add>("add", add);
  const auto client = node_->create_client<Add>("add", {.timeout = 10ms});
  std::int64_t sum = 0;
  const RealtimeScope scope;
  for (int call = 0; call < 1000; ++call) {
    client->async_send_request({.a = call}, [&sum](const auto* answer) { sum += answer->sum; });
    serve(*service);
    serve(*client);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(sum, 999 * 500);
}

// It would read the request in a frame that is gone, and might have dropped the client.
TEST_F(ServiceTest, ACoroutineDoesNotGoOnBeforeItsCallIsSent) {
  const auto service = node_->create_service<Add>("add", add);
  const auto client = node_->create_client<Add>("add", {.timeout = 1ns});
  const auto entity = [&](const std::string& name) { return node_->find_entity(name); };
  std::string end;
  const auto timer = node_->create_timer("ask", 1h, [&]() -> Task<> {
    const Add::Request request{20, 22};
    const auto answer = co_await client->call(request);
    end = answer ? std::to_string(answer->sum) : "none";
  });
  /// What other threads could do while the call is being sent.
  struct Others : Sink {
    std::function<void()> act;
    void announce(const Arrival&) noexcept override { act(); }
    void release_changed() noexcept override {}
    void remove() noexcept override {}
    void expect_remove() noexcept override {}
  } others;
  service->attach(others);
  const auto ask = [&](std::function<void()> act) {
    others.act = [&, act] {
      act();
      EXPECT_FALSE(serve(*entity("ask/resumed")));
      EXPECT_EQ(end, "");
    };
    end.clear();
    timer->release_at(clock_.now());
    EXPECT_TRUE(serve(*timer));
    EXPECT_TRUE(serve(*entity("ask/resumed")));
  };
  ask([&] {
    EXPECT_TRUE(serve(*service));
    EXPECT_TRUE(serve(*client));
  });
  EXPECT_EQ(end, "42");
  ask([&] {
    clock_.advance(1ms);
    EXPECT_TRUE(serve(*entity("add_timeout")));
  });
  EXPECT_EQ(end, "none");
  service->detach();
}

// Two participants of one process stand for two processes: they do not ignore each other.
TEST(ServiceOverDds, AnswersCallsOfAnotherProcess) {
  const int domain = test_domain();
  const auto make_node = [&](const char* name) {
    NodeOptions options;
    options.participant = Participant::create({.domain = domain, .serves_own_process = true});
    return std::make_shared<Node>(name, options);
  };
  const auto server = make_node("server"), caller = make_node("caller");
  const auto service = server->create_service<Add>("add", add);
  const auto client = caller->create_client<Add>("add");
  ASSERT_TRUE(eventually([&] { return client->service_is_ready(); }));
  const auto future = client->async_send_request({.a = 20, .b = 22});
  EXPECT_TRUE(eventually([&] { return serve(*service); }));
  EXPECT_TRUE(eventually([&] { return serve(*client); }));
  ASSERT_TRUE(future.ready());
  EXPECT_EQ(future.get()->sum, 42);
}

}  // namespace
}  // namespace takt
