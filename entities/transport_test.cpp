// One specification for every path that messages take: by pointer in the process, over DDS in one
// process, over DDS between two, and both at once.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <cstring>
#include <random>
#include <thread>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "takt/testing/peer_process.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// The process that publishes.
class Peer : public PeerProcess {
 public:
  Peer() : PeerProcess(TAKT_TRANSPORT_PEER, std::to_string(test_domain())) {}
};

/// A publisher, wherever it lives.
class Sender {
 public:
  virtual ~Sender() = default;
  virtual void publish(std::int64_t value, const std::string& label = "x") = 0;
  virtual std::size_t matched() = 0;
};

class OwnSender final : public Sender {
 public:
  OwnSender(Node& node, const std::string& topic, const QoS& qos)
      : publisher_(node.create_publisher<Labelled>(topic, qos)) {}
  void publish(std::int64_t value, const std::string& label) override {
    publisher_->publish(Labelled{value, label});
  }
  std::size_t matched() override { return publisher_->subscription_count(); }

 private:
  std::shared_ptr<Publisher<Labelled>> publisher_;
};

class PeerSender final : public Sender {
 public:
  PeerSender(Peer& peer, std::string topic, const QoS& qos)
      : peer_(peer), topic_(std::move(topic)) {
    peer_.ask("create " + topic_ + " " + std::to_string(qos.depth) +
              (qos.durability == Durability::transient_local ? " transient_local " : " volatile ") +
              std::to_string(qos.lifespan_duration.count()));
  }
  ~PeerSender() override { peer_.ask("drop " + topic_); }
  void publish(std::int64_t value, const std::string& label) override {
    peer_.ask("publish " + topic_ + " " + std::to_string(value) + " " + label);
  }
  std::size_t matched() override { return std::stoul(peer_.ask("matched " + topic_)); }

 private:
  Peer& peer_;
  const std::string topic_;
};

enum class Way { intra, dds_in_one_process, dds_between_two };

class Transport : public testing::TestWithParam<Way> {
 protected:
  Transport() {
    NodeOptions options;
    if (GetParam() != Way::intra) {
      options.participant = Participant::create(
          {.domain = test_domain(), .serves_own_process = GetParam() == Way::dds_in_one_process});
    }
    node_ = std::make_shared<Node>("node", options);
    if (GetParam() == Way::dds_between_two) peer_ = std::make_unique<Peer>();
  }

  std::unique_ptr<Sender> sender(const std::string& topic, const QoS& qos = 10) {
    if (peer_ != nullptr) return std::make_unique<PeerSender>(*peer_, topic, qos);
    return std::make_unique<OwnSender>(*node_, topic, qos);
  }
  std::shared_ptr<Subscription<Labelled>> subscribe(const std::string& topic, const QoS& qos = 10) {
    return node_->create_subscription<Labelled>(topic, qos, [](const Labelled&) {});
  }
  static std::vector<std::int64_t> take_all(Subscription<Labelled>& subscription) {
    std::vector<std::int64_t> values;
    for (Labelled message; subscription.take(message);) values.push_back(message.value);
    return values;
  }

  std::shared_ptr<Node> node_;
  std::unique_ptr<Peer> peer_;
};

TEST_P(Transport, KeepsTheOrderAndLosesNothing) {
  const auto subscription = subscribe("/order", 200);
  const auto from = sender("/order", 200);
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  std::vector<std::int64_t> sent;
  for (std::int64_t value = 1; value <= 100; ++value) {
    from->publish(value);
    sent.push_back(value);
  }
  ASSERT_TRUE(eventually([&] { return subscription->expected() == 100; }));
  EXPECT_EQ(take_all(*subscription), sent);
}

TEST_P(Transport, CarriesTheContent) {
  const auto subscription = subscribe("/content");
  const auto from = sender("/content");
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  const std::string label(3000, 'z');
  from->publish(-7, label);
  ASSERT_TRUE(eventually([&] { return subscription->ready_count() == 1; }));
  Labelled message;
  ASSERT_TRUE(subscription->take(message));
  EXPECT_EQ(message.value, -7);
  EXPECT_EQ(message.label, label);
}

TEST_P(Transport, KeepsTheNewestOfItsDepthAndCountsTheRest) {
  const auto subscription = subscribe("/depth", 3);
  const auto from = sender("/depth", 20);
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  for (std::int64_t value = 1; value <= 10; ++value) from->publish(value);
  ASSERT_TRUE(eventually([&] { return subscription->expected() == 10; }));
  EXPECT_THAT(take_all(*subscription), ElementsAre(8, 9, 10));
  EXPECT_EQ(subscription->dropped(), 7u);
}

TEST_P(Transport, GivesALateJoinerOnlyWhatComesLater) {
  const auto from = sender("/late");
  const auto early = subscribe("/late");
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  from->publish(1);
  ASSERT_TRUE(eventually([&] { return early->expected() == 1; }));
  const auto late = subscribe("/late");
  ASSERT_TRUE(eventually([&] { return from->matched() == 2; }));
  from->publish(2);
  ASSERT_TRUE(eventually([&] { return late->expected() == 1 && early->expected() == 2; }));
  EXPECT_THAT(take_all(*late), ElementsAre(2));
  EXPECT_THAT(take_all(*early), ElementsAre(1, 2));
}

TEST_P(Transport, KeepsTheLastMessagesForWhoComesLateAndAsksForThem) {
  const auto from = sender("/kept", QoS(2).transient_local());
  for (std::int64_t value = 1; value <= 3; ++value) from->publish(value);
  const auto late = subscribe("/kept", QoS(10).transient_local());
  // By DDS, a message that is published before those are delivered takes the place of the first.
  ASSERT_TRUE(eventually([&] { return late->expected() == 2; }));
  from->publish(4);
  ASSERT_TRUE(eventually([&] { return late->expected() == 3; }));
  EXPECT_THAT(take_all(*late), ElementsAre(2, 3, 4));
}

TEST_P(Transport, DropsWhatIsTooOldWhenItIsTakenAndCountsIt) {
  constexpr Nanoseconds kLifespan = 100ms;
  const auto subscription = subscribe("/old");
  const auto from = sender("/old", QoS(10).lifespan(kLifespan));
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  TimePoint end;
  const auto is_old = [&] { return Clock::steady().now() > end; };
  const auto has_come = [&] { return subscription->ready_count() != 0; };
  // DDS drops what is too old when it arrives, as it may be on a slow machine.
  ASSERT_TRUE(eventually([&] {
    from->publish(1);
    end = Clock::steady().now() + kLifespan;
    return eventually([&] { return has_come() || is_old(); }) && has_come();
  }));
  ASSERT_TRUE(eventually(is_old));
  EXPECT_THAT(take_all(*subscription), ElementsAre());
  EXPECT_NE(subscription->dropped(), 0u);
}

TEST_P(Transport, DeliversNothingToWhoAsksForMoreThanIsOffered) {
  const auto from = sender("/more", 10);
  const auto reliable = subscribe("/more", 10);
  const auto kept = subscribe("/more", QoS(10).transient_local());
  const auto soon = subscribe("/more", QoS(10).deadline(1s));
  const auto lively = subscribe("/more", QoS(10).liveliness(Liveliness::manual_by_topic));
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  from->publish(1);
  ASSERT_TRUE(eventually([&] { return reliable->expected() == 1; }));
  EXPECT_EQ(from->matched(), 1u);
  EXPECT_EQ(kept->expected() + soon->expected() + lively->expected(), 0u);
}

TEST_P(Transport, DeliversNothingAfterTheSubscriptionIsGone) {
  const auto from = sender("/gone");
  auto subscription = subscribe("/gone");
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  subscription.reset();
  EXPECT_TRUE(eventually([&] { return from->matched() == 0; }));
  from->publish(1);
}

TEST_P(Transport, MatchesByTopic) {
  const auto here = subscribe("/here");
  const auto there = subscribe("/there");
  const auto from = sender("/here");
  ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
  from->publish(1);
  ASSERT_TRUE(eventually([&] { return here->expected() == 1; }));
  EXPECT_EQ(there->expected(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Every, Transport,
                         testing::Values(Way::intra, Way::dds_in_one_process, Way::dds_between_two),
                         [](const auto& way) {
                           switch (way.param) {
                             case Way::intra:
                               return "intra";
                             case Way::dds_in_one_process:
                               return "dds_in_one_process";
                             default:
                               return "dds_between_two";
                           }
                         });

// ---- Both at once ----

/// The same name, and another layout.
struct Short {
  std::int32_t value = 0;
};
TAKT_MESSAGE(Short, "test_msgs/msg/Labelled", value);

class RemoteWriterOfShort {
 public:
  RemoteWriterOfShort(Participant& participant, const std::string& topic)
      : writer_(participant.create_writer({topic, &message_type<Short>(), 10})) {}
  bool matched() const { return writer_->reader_count() == 1; }
  void write(std::int32_t value) const {
    const Short message{value};
    writer_->write(&message, {});
  }

 private:
  std::unique_ptr<RemoteWriter> writer_;
};

// Two participants stand for two processes.
class TwoParticipants : public testing::Test {
 protected:
  static std::shared_ptr<Node> node(const std::string& name) {
    NodeOptions options;
    options.participant = Participant::create({.domain = test_domain()});
    return std::make_shared<Node>(name, options);
  }
  const std::shared_ptr<Node> here_ = node("here");
};

TEST_F(TwoParticipants, NoLocalReaderGetsAMessageTwice) {
  Peer peer;
  const PeerSender other(peer, "/twice", 10);
  const auto near = here_->create_subscription<Labelled>("/twice", 10, [](const Labelled&) {});
  const auto publisher = here_->create_publisher<Labelled>("/twice", 10);
  ASSERT_TRUE(eventually([&] { return const_cast<PeerSender&>(other).matched() == 1; }));
  EXPECT_EQ(publisher->subscription_count(), 1u);  // near, by pointer
  publisher->publish(Labelled{1, "own"});
  const_cast<PeerSender&>(other).publish(2, "other");
  ASSERT_TRUE(eventually([&] { return near->expected() == 2; }));
  Labelled message;
  ASSERT_TRUE(near->take(message));
  EXPECT_EQ(message.value, 1);
  ASSERT_TRUE(near->take(message));
  EXPECT_EQ(message.value, 2);
  EXPECT_FALSE(near->take(message));
}

TEST_F(TwoParticipants, SurvivesAKilledPeerAndItsRestart) {
  const auto subscription =
      here_->create_subscription<Labelled>("/killed", 10, [](const Labelled&) {});
  for (int life = 0; life < 2; ++life) {
    Peer peer;
    auto from = std::make_unique<PeerSender>(peer, "/killed", 10);
    ASSERT_TRUE(eventually([&] { return from->matched() == 1; }));
    from->publish(life, "x");
    Labelled message;
    ASSERT_TRUE(eventually([&] { return subscription->take(message); }));
    EXPECT_EQ(message.value, life);
    peer.kill();
  }
}

TEST_F(TwoParticipants, ReportsPublishersThatDieAndThoseThatOfferTooLittle) {
  const auto subscription =
      here_->create_subscription<Labelled>("/events", 10, [](const Labelled&) {});
  const auto asks_for_more = here_->create_subscription<Labelled>(
      "/events", QoS(10).transient_local(), [](const Labelled&) {});
  MatchedStatus matched;
  LivelinessChangedStatus alive;
  IncompatibleQosStatus incompatible;
  const std::vector<std::shared_ptr<Entity>> events{
      here_->create_qos_event<MatchedStatus>(
          *subscription, [&](const MatchedStatus& status) { matched = status; }),
      here_->create_qos_event<LivelinessChangedStatus>(
          *subscription, [&](const LivelinessChangedStatus& status) { alive = status; }),
      here_->create_qos_event<IncompatibleQosStatus>(
          *asks_for_more, [&](const IncompatibleQosStatus& status) { incompatible = status; })};
  const auto becomes_true = [&](auto&& condition) {
    return eventually([&] {
      for (const auto& event : events) {
        for (Slot slot; event->take(slot); slot = {}) event->execute(slot);
      }
      return condition();
    });
  };
  Peer peer;
  const PeerSender from(peer, "/events", 10);
  EXPECT_TRUE(becomes_true([&] { return matched.current_count == 1 && alive.alive_count == 1; }));
  EXPECT_TRUE(becomes_true([&] { return incompatible.last_policy == "durability"; }));
  peer.kill();
  EXPECT_TRUE(becomes_true([&] { return matched.current_count == 0 && alive.alive_count == 0; }));
  EXPECT_EQ(matched.total_count, 1u);
}

// What a process sends that was built from another definition of the type.
TEST_F(TwoParticipants, AMessageOfTheWrongLengthIsDroppedAndCounted) {
  const auto subscription =
      here_->create_subscription<Labelled>("/short", 10, [](const Labelled&) {});
  const auto there = Participant::create({.domain = test_domain()});
  const RemoteWriterOfShort writer(*there, "/short");
  ASSERT_TRUE(eventually([&] { return writer.matched(); }));
  writer.write(1);
  ASSERT_TRUE(eventually([&] { return subscription->ready_count() == 1; }));
  Labelled message;
  EXPECT_FALSE(subscription->take(message));
  EXPECT_EQ(subscription->counts().dropped, 1u);
}

// Cyclone said "Bad Parameter", and of whatever came next too.
TEST(Participant, SaysHowManyEndsItTakes) {
  DdsOptions options;
  options.domain = test_domain();
  options.ros_graph = RosGraph::off;
  const auto participant = Participant::create(options);
  Node node("node", {.participant = participant});
  std::vector<std::shared_ptr<void>> ends;
  try {
    for (int i = 0; i < 10'000; ++i) {
      ends.push_back(node.create_publisher<Labelled>("many", 1));
    }
    FAIL() << "10,000 are more than Cyclone counts";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("at most 8100 publishers and subscriptions on DDS"));
  }
  EXPECT_EQ(participant->endpoints().size(), 8100u);
  ends.pop_back();
  EXPECT_NO_THROW((void)node.create_publisher<Labelled>("many", 1));
}

// Random bytes, and bytes that begin as RTPS does, on the ports of the domain: of the indices of
// ROS 2, on one of which newcomers are heard, and of ours.
TEST_F(TwoParticipants, SurvivesHostileDatagrams) {
  Peer peer;
  PeerSender from(peer, "/hostile", 10);
  const auto subscription =
      here_->create_subscription<Labelled>("/hostile", 10, [](const Labelled&) {});
  ASSERT_TRUE(eventually([&] { return from.matched() == 1; }));

  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  std::mt19937 random(1);
  std::array<std::uint32_t, 64> datagram{};
  for (int i = 0; i < 100'000; ++i) {
    for (std::uint32_t& word : datagram) word = static_cast<std::uint32_t>(random());
    if (i % 2 == 0) std::memcpy(datagram.data(), "RTPS\2\1\1\20", 8);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * test_domain() + 10 + i % 90));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    sendto(socket, datagram.data(), 8 + random() % 248, 0, reinterpret_cast<sockaddr*>(&to),
           sizeof to);
  }
  close(socket);
  EXPECT_GT(dds_warnings(), 0u);
  for (std::int64_t value = 1; value <= 5; ++value) from.publish(value, "x");
  ASSERT_TRUE(eventually([&] { return subscription->expected() == 5; }));
}

/// A peer that publishes to us, and one that we publish to: all that is known of the two.
struct Life : PeerPair<Peer> {
  explicit Life(int number) : label("life" + std::to_string(number)) {
    subscriber.ask("subscribe /faults/out 1000");
  }
  PeerSender sender{publisher, "/faults/in", 100};
  const std::string label;
  std::int64_t sent = 0, arrived = 0;
};

/// Waits until this is the last message that the life has received; none is missing before it.
void expect_received(const Life& life, std::int64_t last) {
  ASSERT_TRUE(
      eventually([&] { return life.subscriber.ask("last /faults/out") == std::to_string(last); }));
  EXPECT_EQ(life.subscriber.ask("gaps /faults/out"), "0");
}

// Each published message arrives once, in order, except those that died with their publisher: also
// at a process that was stopped, as the publisher's depth is larger than what it misses. And
// nothing is left behind.
TEST_F(TwoParticipants, SurviveOthersThatAreKilledStoppedAndRestarted) {
  const auto end = std::chrono::steady_clock::now() + fault_time();
  constexpr std::size_t kLives = 2;
  std::mt19937 random(1);
  const auto below = [&](std::uint32_t limit) {
    return static_cast<std::uint32_t>(random() % limit);
  };
  const auto own = here_->create_publisher<Labelled>("/faults/out", 1000);
  std::int64_t own_value = 0;
  std::vector<std::unique_ptr<Life>> lives(kLives);
  const auto subscription =
      here_->create_subscription<Labelled>("/faults/in", 1000, [](const Labelled&) {});
  const auto receive = [&] {
    for (Labelled message; subscription->take(message);) {
      for (const auto& life : lives) {
        if (life == nullptr || life->label != message.label) continue;
        EXPECT_EQ(message.value, ++life->arrived) << message.label;
      }
    }
  };
  int births = 0;
  const auto restart = [&](std::unique_ptr<Life>& life) {
    life = std::make_unique<Life>(births++);
    ASSERT_TRUE(eventually([&] { return life->sender.matched() == 1; }));
    ASSERT_TRUE(eventually([&] {
      own->publish(Labelled{++own_value, "x"});
      return life->subscriber.ask("last /faults/out") != "0";
    }));
  };
  for (auto& life : lives) restart(life);
  const Footprint before = footprint(getpid());
  while (std::chrono::steady_clock::now() < end && !HasFatalFailure()) {
    std::unique_ptr<Life>& life = lives[below(kLives)];
    switch (below(8)) {
      case 0:
        life->kill();
        receive();
        restart(life);
        break;
      case 1:
        life->stop();
        for (int i = 0; i < 20; ++i) own->publish(Labelled{++own_value, "x"});
        std::this_thread::sleep_for(std::chrono::milliseconds(below(300)));
        life->resume();
        break;
      default:
        for (std::uint32_t i = 1 + below(20); i != 0; --i) {
          life->sender.publish(++life->sent, life->label);
          own->publish(Labelled{++own_value, "x"});
        }
    }
    receive();
  }
  for (const auto& life : lives) {
    ASSERT_TRUE(eventually([&] { return receive(), life->arrived == life->sent; })) << life->label;
    expect_received(*life, own_value);
  }
  expect_flat(before, footprint(getpid()));
}

TEST_F(TwoParticipants, AnotherTypeOfTheSameTopicIsNotMatched) {
  Peer peer;
  PeerSender from(peer, "/typed", 10);
  const auto right = here_->create_subscription<Labelled>("/typed", 10, [](const Labelled&) {});
  ASSERT_TRUE(eventually([&] { return from.matched() == 1; }));
  EXPECT_THAT(
      [&] {
        (void)here_->create_subscription<takt::OtherLabelled>("/typed", 10,
                                                              [](const takt::OtherLabelled&) {});
      },
      ThrowsMessage<Error>(HasSubstr("/typed")));
}

TEST(Participant, GivesItsThreadsTheAttributesOfTheOptions) {
  std::thread([] {}).join();  // with the first thread comes that of the thread sanitizer
  const int cpu = available_cpus().back();
  const auto participant =
      Participant::create({.domain = test_domain(), .threads = {.affinity = {cpu}}});
  ASSERT_FALSE(participant->threads().empty());
  for (const ThreadState& thread : participant->threads()) {
    EXPECT_THAT(thread.affinity, ElementsAre(cpu)) << thread.name;
  }
}

}  // namespace
}  // namespace takt
