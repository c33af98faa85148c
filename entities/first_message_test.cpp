// Two processes find each other, and the first message comes.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "takt/testing/peer_process.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

/// How many pairs begin; TAKT_PAIRS overrides it.
int pairs() {
  const char* pairs = std::getenv("TAKT_PAIRS");
  return pairs != nullptr ? std::atoi(pairs) : 6;
}

// The publisher had discovered the subscription, but the subscription's side took what it found at
// the publisher's first heartbeat for older than itself: the first message was lost.
TEST(FirstMessage, ComesOnceTheSubscriptionIsCounted) {
  const PeerProcess peer(TAKT_TRANSPORT_PEER, std::to_string(test_domain()));
  NodeOptions options;
  options.participant = Participant::create({.domain = test_domain()});
  Node here("here", options);
  for (int i = 0; i < pairs(); ++i) {
    const std::string topic = "/pair" + std::to_string(i);
    std::shared_ptr<Subscription<Labelled>> subscription;
    const auto subscribe = [&] {
      subscription = here.create_subscription<Labelled>(topic, 10, [](const Labelled&) {});
    };
    if (i % 2 == 0) subscribe();
    ASSERT_EQ(peer.ask("create " + topic + " 10 volatile"), "ok");
    if (i % 2 != 0) subscribe();
    ASSERT_TRUE(eventually([&] { return peer.ask("matched " + topic) == "1"; }));
    ASSERT_EQ(peer.ask("publish " + topic + " 1 x"), "ok");
    ASSERT_EQ(peer.ask("publish " + topic + " 2 x"), "ok");
    Labelled message;
    ASSERT_TRUE(eventually([&] { return subscription->take(message); }));
    EXPECT_EQ(message.value, 1) << "of pair " << i;
    ASSERT_EQ(peer.ask("drop " + topic), "ok");
  }
}

// A subscription of a process that does not answer: it is not waited for for ever.
TEST(FirstMessage, IsNotHeldBackForAProcessThatHangs) {
  const PeerProcess peer(TAKT_TRANSPORT_PEER, std::to_string(test_domain()));
  NodeOptions options;
  options.participant = Participant::create({.domain = test_domain()});
  Node here("here", options);
  ASSERT_EQ(peer.ask("subscribe /hangs 10"), "ok");
  const auto watch = here.create_publisher<Labelled>("/other", 10);
  peer.ask("subscribe /other 10");
  ASSERT_TRUE(eventually([&] { return watch->subscription_count() == 1; }));
  peer.stop();
  const auto publisher = here.create_publisher<Labelled>("/hangs", 10);
  EXPECT_TRUE(eventually([&] { return publisher->subscription_count() == 1; }));
  peer.resume();
}

}  // namespace
}  // namespace takt
