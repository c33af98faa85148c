// A service and its clients discover each other's two ends one after the other.
// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include <gtest/gtest.h>

#include "takt/entities/generic_publisher.hpp"
#include "takt/entities/generic_subscription.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/testing/sanitized.hpp"
#include "takt/testing/serve.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

using Bytes = std::vector<std::byte>;

// Of Add, behind the header of CDR.
struct Words {
  std::int64_t words[4];
  Bytes bytes(std::size_t count) const {
    Bytes result{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    result.resize(4 + 8 * count);
    std::memcpy(result.data() + 4, words, 8 * count);
    return result;
  }
};

class ServiceDiscovery : public testing::Test {
 protected:
  // Two participants of one process stand for two processes: they do not ignore each other.
  static std::shared_ptr<Participant> join() {
    return Participant::create({.domain = test_domain(), .serves_own_process = true});
  }
  // The ends of a client or service, by bytes.
  Endpoint end(const std::string& topic, const std::string& type, const std::string& id) const {
    const MessageType& message = serialized_type(type);
    return {topic, &message, QoS(10), "", {id, &message, &message}};
  }
  Endpoint requests(const std::string& id) const {
    return end("rq/addRequest", "test_msgs/srv/Add_Request", id);
  }
  Endpoint responses(const std::string& id) const {
    return end("rr/addReply", "test_msgs/srv/Add_Response", id);
  }
  std::unique_ptr<GenericSubscription> receiver(const Endpoint& endpoint) {
    auto result = std::make_unique<GenericSubscription>(
        endpoint.topic, group_, endpoint,
        [this](std::span<const std::byte> bytes, const MessageInfo&) {
          received_.emplace_back(bytes.begin(), bytes.end());
        },
        others_);
    result->start();
    return result;
  }
  std::unique_ptr<GenericPublisher> sender(const Endpoint& endpoint) {
    return std::make_unique<GenericPublisher>(endpoint, Clock::steady(), others_);
  }

  // Whether the client by bytes and the service have found each other's ends of the requests.
  bool requests_match(const SubscriptionBase& service) const {
    for (const EndpointState& end : others_->endpoints()) {
      if (end.is_writer && end.topic == "rq/addRequest") {
        return end.matched == 1 && service.outside_publisher_count() == 1;
      }
    }
    return false;
  }

  const std::shared_ptr<Node> node_ =
      std::make_shared<Node>("node", NodeOptions{.participant = join()});
  const std::shared_ptr<Participant> others_ = join();
  const std::shared_ptr<CallbackGroup> group_ =
      std::make_shared<CallbackGroup>("group", CallbackGroupType::MutuallyExclusive);
  std::vector<Bytes> received_;
};

TEST_F(ServiceDiscovery, AResponseWaitsForTheReaderOfItsClient) {
  const auto service =
      node_->create_service<Add>("add", [](const Add::Request& request, Add::Response& response) {
        response.sum = request.a + request.b;
      });
  // Another client, whose writer has not been discovered, must not count for the first one.
  const auto other_ear = receiver(responses("clientid=2;"));
  const auto asks = sender(requests("clientid=1;"));
  ASSERT_TRUE(eventually([&] { return requests_match(*service); }));
  for (const std::int64_t sequence : {1, 2}) {
    asks->publish(Words{{77, sequence, 20, sequence}}.bytes(4));
    ASSERT_TRUE(eventually([&] { return serve(*service); }));
  }
  const auto hears = receiver(responses("clientid=1;"));
  received_.clear();
  ASSERT_TRUE(eventually([&] {
    serve(*hears);
    return received_.size() == 2;
  }));
  EXPECT_EQ(received_[0], (Words{{77, 1, 21}}.bytes(3)));
  EXPECT_EQ(received_[1], (Words{{77, 2, 22}}.bytes(3)));
}

TEST_F(ServiceDiscovery, AResponseForAClientThatHasGoneDoesNotStay) {
  const auto service =
      node_->create_service<Add>("add", [](const Add::Request&, Add::Response&) {});
  auto asks = sender(requests("clientid=1;"));
  ASSERT_TRUE(eventually([&] { return requests_match(*service); }));
  asks->publish(Words{{77, 1, 0, 0}}.bytes(4));
  ASSERT_TRUE(eventually([&] { return serve(*service); }));
  asks.reset();
  ASSERT_TRUE(eventually([&] { return service->outside_publisher_count() == 0; }));
  // The next client has the same id, and gets its own response only.
  asks = sender(requests("clientid=1;"));
  const auto hears = receiver(responses("clientid=1;"));
  ASSERT_TRUE(eventually([&] { return requests_match(*service); }));
  asks->publish(Words{{77, 2, 0, 0}}.bytes(4));
  ASSERT_TRUE(eventually([&] {
    serve(*service);
    serve(*hears);
    return !received_.empty() && received_.back() == Words{{77, 2, 0}}.bytes(3);
  }));
}

TEST_F(ServiceDiscovery, AServiceIsReadyWhenBothOfItsEndsAre) {
  const auto client = node_->create_client<Add>("add");
  const auto one_hears = receiver(requests("serviceid=1;"));
  const auto another_answers = sender(responses("serviceid=2;"));
  ASSERT_TRUE(eventually([&] {
    return another_answers->subscription_count() == 1 && client->outside_publisher_count() == 1;
  }));
  EXPECT_FALSE(client->service_is_ready());
  const auto one_answers = sender(responses("serviceid=1;"));
  EXPECT_TRUE(eventually([&] { return client->service_is_ready(); }));
}

// The other process makes a service a thousand times, and this one calls it as soon as it says that
// it is ready.
TEST_F(ServiceDiscovery, AServiceThatIsReadyAnswersHoweverNewItIs) {
  const auto here = std::make_shared<Node>(
      "here", NodeOptions{.participant = Participant::create({.domain = test_domain()})});
  const PeerProcess peer(TAKT_TRANSPORT_PEER, std::to_string(test_domain()));
  std::shared_ptr<Client<Add>> client;
  constexpr int kRounds = 1000 / kFewerSanitized;
  for (int i = 0; i < kRounds; ++i) {
    // A client that is older than the service, and one that is as new.
    if (i % 2 == 0) client = here->create_client<Add>("add_often");
    ASSERT_EQ(peer.ask("serve add_often"), "ok");
    ASSERT_TRUE(eventually([&] { return client->service_is_ready(); })) << i;
    const auto future = client->async_send_request({.a = i, .b = 1});
    ASSERT_EQ(peer.ask("answer add_often"), "ok") << i;
    ASSERT_TRUE(eventually([&] { return serve(*client) && future.ready(); })) << i;
    ASSERT_EQ(future.get()->sum, i + 1);
    ASSERT_EQ(peer.ask("end add_often"), "ok");
    ASSERT_TRUE(eventually([&] { return !client->service_is_ready(); })) << i;
  }
}

}  // namespace
}  // namespace takt
