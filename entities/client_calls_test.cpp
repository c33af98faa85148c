// How calls end that nobody answers, and what many of them cost.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/entities/client.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/testing/serve.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using Calls = detail::PendingCalls<int>;

class ClientCalls : public testing::Test {
 protected:
  std::shared_ptr<Service<Add>> make_service() {
    return node_->create_service<Add>("add",
                                      [](const Add::Request& request, Add::Response& response) {
                                        response.sum = request.a + request.b;
                                      });
  }
  void call(Client<Add>& client, const std::string& name) {
    client.async_send_request({.a = 1, .b = 2}, [this, name](const Add::Response* answer) {
      trace_.push_back(name + (answer != nullptr ? " answered" : " ended"));
    });
  }
  void run(Nanoseconds duration = 0ms) {
    clock_.advance(duration);
    for (bool more = true; std::exchange(more, false);) {
      for (const auto& entity : node_->entities()) {
        while (serve(*entity)) more = true;
      }
    }
  }

  ManualClock clock_;
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<std::string> trace_;
};

// It waited for ever then.
TEST_F(ClientCalls, ACallEndsTwoSecondsAfterItsServiceHasGone) {
  auto service = make_service();
  const auto client = node_->create_client<Add>("add");
  call(*client, "early");
  clock_.advance(1h);  // the service may take as long as it likes
  service.reset();
  run(1s);
  call(*client, "late");  // nobody hears it
  run(999ms);
  EXPECT_TRUE(trace_.empty());
  run(1ms);
  EXPECT_THAT(trace_, ElementsAre("early ended"));
  service = make_service();  // does not know of the other one
  run(1s);
  EXPECT_THAT(trace_, ElementsAre("early ended", "late ended"));
  call(*client, "next");
  run();
  EXPECT_THAT(trace_, ElementsAre("early ended", "late ended", "next answered"));
}

// A client that did not want an answer any more held the call's place, and its callback, for ever.
TEST_F(ClientCalls, AForgottenCallGivesItsPlaceBack) {
  const auto client = node_->create_client<Add>("add", {.calls_in_flight = 1});
  const auto owned = std::make_shared<int>();
  const std::int64_t first = client->async_send_request({.a = 1}, [owned](const Add::Response*) {});
  EXPECT_TRUE(client->is_pending(first));
  EXPECT_TRUE(client->forget(first));
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_FALSE(client->is_pending(first));
  EXPECT_FALSE(client->forget(first));
  const auto service = make_service();
  call(*client, "next");
  run();
  EXPECT_THAT(trace_, ElementsAre("next answered"));
}

TEST_F(ClientCalls, ACallThatRepeatsIsAnsweredByTheServiceThatComes) {
  const auto client = node_->create_client<Add>("add", {.repeats = true});
  call(*client, "one");
  run(1s);
  auto service = make_service();
  run();
  EXPECT_THAT(trace_, ElementsAre("one answered"));
  call(*client, "two");
  service.reset();
  service = make_service();
  run();
  EXPECT_THAT(trace_, ElementsAre("one answered", "two answered"));
}

TEST_F(ClientCalls, ACallWaitsOnAsInRos2IfOneSaysSo) {
  const auto client = node_->create_client<Add>("add", {.without_service = Nanoseconds::max()});
  call(*client, "call");
  run(1h);
  EXPECT_TRUE(trace_.empty());
  EXPECT_EQ(node_->entities().size(), 1u);  // nor has it a timer
}

TEST_F(ClientCalls, AClientWithoutCallsIsNotWokenByServicesThatComeAndGo) {
  const auto client = node_->create_client<Add>("add", {.repeats = true});
  for (int i = 0; i < 3; ++i) make_service();
  EXPECT_EQ(node_->find_entity("add_timeout")->next_release(), kNever);
}

TEST(ClientCallsOverDds, ACallEndsWhenTheProcessOfItsServiceIsKilled) {
  const auto node = std::make_shared<Node>(
      "here", NodeOptions{.participant = Participant::create({.domain = test_domain()})});
  PeerProcess peer(TAKT_TRANSPORT_PEER, std::to_string(test_domain()));
  const auto client = node->create_client<Add>("add", {.without_service = 10ms});
  ASSERT_EQ(peer.ask("serve add"), "ok");
  ASSERT_TRUE(eventually([&] { return client->service_is_ready(); }));
  const auto future = client->async_send_request({.a = 1, .b = 2});
  peer.kill();
  const auto timer = node->find_entity("add_timeout");
  ASSERT_TRUE(eventually([&] { return serve(*timer); }));
  ASSERT_TRUE(future.ready());
  EXPECT_FALSE(future.get().has_value());
}

// ---- Many calls ----

TEST(PendingCalls, EndInTheOrderOfTheirTimeOuts) {
  Calls calls({.calls_in_flight = 4, .timeout = 10ns});
  std::vector<std::int64_t> numbers;
  for (int i = 0; i < 4; ++i) numbers.push_back(*calls.begin(TimePoint(Nanoseconds(i)), i));
  EXPECT_FALSE(calls.begin(TimePoint(4ns), 4));
  OwnedBlock answer;
  EXPECT_EQ(calls.end(numbers[1], answer), 1);
  EXPECT_EQ(calls.end(numbers[1], answer), std::nullopt);
  EXPECT_NE(calls.begin(TimePoint(5ns), 5), numbers[1]);
  EXPECT_EQ(calls.next_deadline(), TimePoint(10ns));
  EXPECT_EQ(calls.end_late(TimePoint(9ns)), std::nullopt);
  for (const int left : {0, 2, 3, 5}) EXPECT_EQ(calls.end_late(TimePoint(15ns)), left);
  EXPECT_EQ(calls.count(), 0u);
  EXPECT_EQ(calls.next_deadline(), kNever);
}

TEST(PendingCalls, LoseTheirServiceTogetherButEndNoLaterThanTheirTimeOuts) {
  Calls calls({.calls_in_flight = 3, .timeout = 10ns});
  calls.begin(TimePoint(0ns), 0);
  calls.begin(TimePoint(5ns), 5);
  calls.begin(TimePoint(6ns), 6);
  calls.end_by(TimePoint(12ns));
  EXPECT_EQ(calls.end_late(TimePoint(10ns)), 0);
  EXPECT_EQ(calls.take_given_up(), 0u);
  EXPECT_EQ(calls.next_deadline(), TimePoint(12ns));
  EXPECT_EQ(calls.end_late(TimePoint(12ns)), 5);
  calls.resume();
  EXPECT_EQ(calls.next_deadline(), TimePoint(16ns));
  EXPECT_EQ(calls.take_given_up(), 1u);
}

// All places were looked at for each call, twice: 16,000 calls took 7 s. The time of many is
// compared with that of few, in turns, as both are disturbed alike; it was 16 times as long each.
TEST(PendingCalls, CostTheSameHoweverManyThereAre) {
  const auto time_of = [](std::size_t in_flight) {
    Calls calls({.calls_in_flight = in_flight, .timeout = 1h});
    OwnedBlock answer;
    std::vector<std::int64_t> numbers(in_flight);
    constexpr std::size_t kCalls = 16000;
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t done = 0; done < kCalls; done += in_flight) {
      for (auto& number : numbers) {
        number = *calls.begin(TimePoint(Nanoseconds(done)), 0);
        calls.next_deadline();
      }
      for (const auto number : numbers) calls.end(number, answer);
    }
    return std::chrono::steady_clock::now() - begin;
  };
  auto few = time_of(1000), many = time_of(16000);
  for (int round = 0; round < 5; ++round) {
    few = std::min(few, time_of(1000));
    many = std::min(many, time_of(16000));
  }
  EXPECT_LT(many, 6 * few);
}

}  // namespace
}  // namespace takt
