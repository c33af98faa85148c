// Between processes by shared memory. A machine has one RouDi, and a process can use one in its
// life; so each test starts its own, and all that use it are processes of their own.
// SPDX-License-Identifier: Apache-2.0
#include "takt/testing/shared_memory.hpp"

#include <filesystem>
#include <memory>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace takt {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST_F(BySharedMemory, ALoanIsReadWhereItWasWritten) {
  start_roudi();
  const Peer from("require"), to("require");
  for (const std::string type : {"block", "image"}) {
    const std::string topic = "/" + type;
    match(from, to, type, topic);
    EXPECT_EQ(from.ask("publish " + topic + " 7 20 1000"), "ok");
    ASSERT_TRUE(to.has(topic, 20)) << type;
    const Received received = to.received(topic);
    EXPECT_EQ(received.received + received.lost, 20u);
    EXPECT_EQ(received.last, 26);
    EXPECT_EQ(received.broken, 0u);
    EXPECT_EQ(from.state(topic).uncopied, 20u);
    EXPECT_EQ(from.state(topic).transport, "shared memory");
    EXPECT_EQ(to.state(topic).uncopied, received.received);
  }
}

TEST_F(BySharedMemory, WhatWasNotLentIsCopiedOnce) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/copied");
  EXPECT_EQ(from.ask("copy /copied 3"), "ok");
  ASSERT_TRUE(to.has("/copied", 1));
  EXPECT_EQ(to.received("/copied").last, 3);
  EXPECT_EQ(to.received("/copied").broken, 0u);
  EXPECT_EQ(to.state("/copied").uncopied, 1u);
  EXPECT_EQ(from.state("/copied").messages, 1u);
  EXPECT_EQ(from.state("/copied").uncopied, 0u);
}

TEST_F(BySharedMemory, VariableSizeGoesByUdp) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "text", "/text");
  EXPECT_EQ(from.ask("publish /text 5"), "ok");
  ASSERT_TRUE(to.has("/text", 1));
  EXPECT_EQ(to.received("/text").last, 5);
  EXPECT_EQ(from.state("/text").transport, "UDP: variable size");
}

TEST_F(BySharedMemory, ManyLoansFallBackToThePool) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/many");
  EXPECT_EQ(from.ask("borrow /many 12"), "12");  // seven of them in shared memory
  EXPECT_EQ(from.ask("publish /many 1"), "ok");
  ASSERT_TRUE(to.has("/many", 1));
  EXPECT_EQ(from.state("/many").uncopied, 0u);
  EXPECT_EQ(from.ask("return /many"), "ok");
  EXPECT_EQ(from.ask("publish /many 2"), "ok");
  ASSERT_TRUE(to.has("/many", 2));
  EXPECT_EQ(to.received("/many").last, 2);
  EXPECT_EQ(to.received("/many").broken, 0u);
  EXPECT_EQ(from.state("/many").uncopied, 1u);
}

TEST_F(BySharedMemory, AReaderOfTheOwnProcessGetsAMessageOnce) {
  start_roudi();
  const Peer from("require"), to("require");
  ASSERT_EQ(from.ask("subscription block /both 10"), "ok");
  ASSERT_EQ(to.ask("subscription block /both 10"), "ok");
  ASSERT_EQ(from.ask("publisher block /both 10"), "ok");
  ASSERT_TRUE(eventually([&] { return from.ask("matched /both") == "2"; }));
  ASSERT_TRUE(eventually([&] { return to.ask("heard /both") == "1"; }));
  EXPECT_EQ(from.ask("publish /both 1 5 1000"), "ok");
  ASSERT_TRUE(to.has("/both", 5));
  ASSERT_TRUE(from.has("/both", 5));
  EXPECT_EQ(from.ask("publish /both 6"), "ok");
  ASSERT_TRUE(to.has("/both", 6));
  EXPECT_EQ(from.received("/both").expected, 6u);
  EXPECT_EQ(to.received("/both").expected, 6u);
  EXPECT_EQ(to.received("/both").last, 6);
}

TEST_F(BySharedMemory, WithAndWithoutTalkByUdp) {
  start_roudi();
  const Peer from("require"), with("require"), without("off");
  match(from, with, "block", "/mixed");
  ASSERT_EQ(without.ask("subscription block /mixed 10"), "ok");
  ASSERT_TRUE(eventually([&] { return from.ask("matched /mixed") == "2"; }));
  ASSERT_TRUE(eventually([&] { return with.ask("heard /mixed") == "1"; }));
  EXPECT_EQ(from.ask("publish /mixed 1 5 1000"), "ok");
  for (const Peer* to : {&with, &without}) {
    ASSERT_TRUE(to->has("/mixed", 5));
    EXPECT_EQ(to->received("/mixed").last, 5);
    EXPECT_EQ(to->received("/mixed").broken, 0u);
  }
  EXPECT_EQ(without.state("/mixed").transport, "UDP: switched off");

  match(without, with, "block", "/back");
  EXPECT_EQ(without.ask("publish /back 9"), "ok");
  ASSERT_TRUE(with.has("/back", 1));
  EXPECT_EQ(with.received("/back").last, 9);
}

TEST_F(BySharedMemory, MessagesCanBeHeldForLongerThanTheirReader) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/kept", 200);
  EXPECT_EQ(to.ask("keep /kept"), "ok");
  EXPECT_EQ(from.ask("publish /kept 1 300 100"), "ok");  // more than iceoryx lets a reader hold
  ASSERT_TRUE(to.has("/kept", 300));
  const Received received = to.received("/kept");
  EXPECT_EQ(received.received + received.lost, 300u);
  EXPECT_EQ(received.last, 300);
  EXPECT_EQ(to.ask("drop /kept"), "ok");
  EXPECT_EQ(to.ask("check /kept"), std::to_string(received.received));
  EXPECT_EQ(to.ask("forget /kept"), "ok");
  match(from, to, "block", "/next");
  EXPECT_EQ(from.ask("publish /next 1"), "ok");
  EXPECT_TRUE(to.has("/next", 1));
}

TEST_F(BySharedMemory, WhatIsOverwrittenIsCounted) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/fast", 2);
  EXPECT_EQ(from.ask("publish /fast 1"), "ok");
  ASSERT_TRUE(to.has("/fast", 1));
  to.stop();
  EXPECT_EQ(from.ask("publish /fast 2 1999 1"), "ok");
  to.resume();
  ASSERT_TRUE(to.has("/fast", 2000));
  ASSERT_TRUE(eventually([&] { return to.received("/fast").last == 2000; }));
  const Received received = to.received("/fast");
  EXPECT_EQ(received.expected, 2000u);
  EXPECT_EQ(received.received + received.lost, 2000u);
  EXPECT_EQ(to.state("/fast").messages, 2000u);
  EXPECT_EQ(to.state("/fast").lost, 1999u - 100);  // as many as its queue holds
}

TEST_F(BySharedMemory, WritersThatComeAndGoMakeNothingLost) {
  start_roudi();
  const Peer stays("require"), to("require");
  match(stays, to, "block", "/many");
  std::size_t sent = 0;
  const auto send = [&](const Peer& from) {
    EXPECT_EQ(from.ask("publish /many 1"), "ok");
    ASSERT_TRUE(to.has("/many", ++sent));
  };
  for (int round = 0; round < 2; ++round) {
    const Peer goes("require");
    ASSERT_EQ(goes.ask("publisher block /many 10"), "ok");
    ASSERT_TRUE(eventually([&] { return goes.ask("matched /many") == "1"; }));
    ASSERT_TRUE(eventually([&] { return to.ask("heard /many") == "2"; }));
    for (int i = 0; i < 3; ++i) {
      send(stays);
      send(goes);
    }
  }
  ASSERT_TRUE(eventually([&] { return to.ask("heard /many") == "1"; }));
  send(stays);
  EXPECT_EQ(to.state("/many").lost, 0u);
  EXPECT_EQ(to.received("/many").expected, sent);
}

TEST_F(BySharedMemory, EmptyPoolsAreCountedAndNoEnd) {
  roudi_ = std::make_unique<RoudiProcess>(std::vector<ChunkPool>{{1024, 12}});
  const Peer from("require"), to("require");
  match(from, to, "block", "/empty", 20);
  EXPECT_EQ(to.ask("keep /empty"), "ok");
  EXPECT_EQ(from.ask("publish /empty 1 15 1000"), "ok");
  const EndState full = from.state("/empty");
  EXPECT_EQ(full.messages + full.lost, 15u);
  EXPECT_EQ(full.lost, 3u);  // of 15, as there are 12 chunks
  ASSERT_TRUE(to.has("/empty", full.messages));
  EXPECT_EQ(to.ask("forget /empty"), "ok");
  EXPECT_EQ(from.ask("publish /empty 16"), "ok");
  ASSERT_TRUE(to.has("/empty", full.messages + 1));
  EXPECT_EQ(to.received("/empty").last, 16);
}

TEST_F(BySharedMemory, TooLargeForThePoolsGoesByUdpOrIsRefused) {
  roudi_ = std::make_unique<RoudiProcess>(std::vector<ChunkPool>{{1024, 100}});
  const Peer from, to, strict("require");
  match(from, to, "image", "/large");
  EXPECT_EQ(from.state("/large").transport,
            "UDP: 5000016 bytes do not fit into RouDi's largest pool");
  EXPECT_EQ(from.ask("publish /large 4"), "ok");
  ASSERT_TRUE(to.has("/large", 1));
  EXPECT_EQ(to.received("/large").broken, 0u);
  EXPECT_THAT(strict.ask("publisher image /large 10"),
              HasSubstr("topic '/large' cannot go by shared memory: 5000016 bytes do not fit"));
}

TEST_F(BySharedMemory, WithoutRoudiItIsUdpOrRefused) {
  const Peer from, to, strict("require");
  EXPECT_THAT(strict.greeting(), StartsWith("shared memory is required: RouDi is not running"));
  match(from, to, "block", "/without");
  EXPECT_EQ(from.ask("publish /without 4"), "ok");
  ASSERT_TRUE(to.has("/without", 1));
  EXPECT_EQ(from.state("/without").transport, "UDP: RouDi is not running");
}

TEST_F(BySharedMemory, GoesOnWhenRoudiIsKilled) {
  start_roudi();
  const Peer from, to, strict("require");
  match(from, to, "block", "/on");
  EXPECT_EQ(from.ask("publish /on 1"), "ok");
  ASSERT_TRUE(to.has("/on", 1));

  kill(roudi_->pid(), SIGKILL);
  ASSERT_TRUE(eventually([] { return find_roudi().pid == 0; }));
  EXPECT_EQ(from.ask("publish /on 2 10 1000"), "ok");
  ASSERT_TRUE(to.has("/on", 11));
  EXPECT_EQ(to.received("/on").last, 11);
  EXPECT_EQ(from.state("/on").uncopied, 11u);

  match(from, to, "block", "/new");
  EXPECT_EQ(from.state("/new").transport, "UDP: RouDi is not running");
  EXPECT_EQ(from.ask("publish /new 1"), "ok");
  ASSERT_TRUE(to.has("/new", 1));
  EXPECT_THAT(strict.ask("publisher block /new 10"), HasSubstr("RouDi is not running"));
  EXPECT_THAT(Peer("require").greeting(), HasSubstr("RouDi is not running"));

  roudi_.reset();
  start_roudi();  // older processes cannot use it, and new ones can
  const Peer late("require");
  ASSERT_EQ(late.greeting(), "ok");
  match(from, late, "block", "/late");
  EXPECT_EQ(from.state("/late").transport, "UDP: RouDi was started again after this process");
  EXPECT_EQ(from.ask("publish /late 5"), "ok");
  ASSERT_TRUE(late.has("/late", 1));
  EXPECT_EQ(late.received("/late").last, 5);
}

// They used iceoryx' own static objects, which had gone before.
TEST_F(BySharedMemory, EndsMayHaveStaticStorage) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__)
  GTEST_SKIP() << "they stop iceoryx' thread, which waits in memory that has been given back";
#endif
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/static");
  EXPECT_EQ(from.ask("publish /static 1"), "ok");
  ASSERT_TRUE(to.has("/static", 1));
  for (const Peer* const peer : {&from, &to}) {
    EXPECT_EQ(peer->ask("exit"), "dead");
    siginfo_t info{};
    ASSERT_TRUE(eventually([&] {
      const auto pid = static_cast<id_t>(peer->pid());
      return waitid(P_PID, pid, &info, WEXITED | WNOWAIT | WNOHANG) == 0 && info.si_pid != 0;
    }));
    EXPECT_EQ(info.si_code, CLD_EXITED) << "signal " << info.si_status;
    EXPECT_EQ(info.si_status, 0);
  }
}

TEST_F(BySharedMemory, SurvivesKilledPeers) {
  start_roudi();
  const Peer from("require");
  ASSERT_EQ(from.ask("publisher block /killed 10"), "ok");
  for (int life = 1; life <= 3; ++life) {
    const Peer to("require");
    ASSERT_EQ(to.ask("subscription block /killed 10"), "ok");
    ASSERT_TRUE(eventually([&] {
      from.ask("publish /killed " + std::to_string(life));
      return to.received("/killed").last == life;
    }));
    to.kill();
  }
}

/// A process that publishes to the one that stays, and one that receives from it.
struct SharedLife : PeerPair<Peer> {
  SharedLife() : PeerPair("require") {}
};

/// Counts what the process that stays has to receive, and what it has published.
struct Traffic {
  void send(const SharedLife& life, std::int64_t times) {
    life.publisher.ask(fmt::format("publish /in {} {} 100", sent + 1, times));
    sent += times;
  }
  void publish(std::uint32_t times) {
    stays.ask(fmt::format("publish /out {} {} 100", published + 1, times));
    published += times;
  }
  const Peer& stays;
  std::int64_t sent = 0, published = 0;
};

/// Whether each message was received or counted, and none is broken.
void expect_complete(const Received& received, std::uint64_t expected) {
  EXPECT_EQ(received.received + received.lost, expected);
  EXPECT_EQ(received.broken, 0u);
}

/// Starts the processes of a life, until they know the topics.
void start(std::unique_ptr<SharedLife>& life) {
  life = std::make_unique<SharedLife>();
  ASSERT_EQ(life->publisher.ask("publisher block /in 10"), "ok");
  ASSERT_EQ(life->subscriber.ask("subscription block /out 100"), "ok");
  ASSERT_TRUE(eventually([&] { return life->publisher.ask("matched /in") == "1"; }))
      << life->publisher.ask("matched /in") << " of a publisher that answered "
      << life->publisher.greeting();
}

// Each message is received or counted, by old and new processes, and the old ones hold no more than
// before.
TEST_F(BySharedMemory, SurvivesOthersThatAreKilledStoppedAndRestarted) {
  roudi_ = std::make_unique<RoudiProcess>(std::vector<ChunkPool>{{1024, 50'000}});
  const Peer stays("require");
  ASSERT_EQ(stays.ask("subscription block /in 100"), "ok");
  ASSERT_EQ(stays.ask("publisher block /out 10"), "ok");
  std::mt19937 random(1);
  const auto below = [&](std::uint32_t limit) {
    return static_cast<std::uint32_t>(random() % limit);
  };
  Traffic traffic{stays};
  std::vector<std::unique_ptr<SharedLife>> lives(2);
  const auto restart = [&](std::unique_ptr<SharedLife>& life) {
    ASSERT_NO_FATAL_FAILURE(start(life));
    ASSERT_TRUE(eventually([&] {  // until the old processes know it
      traffic.send(*life, 1);
      return stays.received("/in").last == traffic.sent;
    }));
    ASSERT_TRUE(eventually([&] {
      traffic.publish(1);
      return life->subscriber.received("/out").last == traffic.published;
    }));
  };
  for (auto& life : lives) restart(life);
  const Footprint before = footprint(stays.pid());
  int deaths = 0;
  const auto end = std::chrono::steady_clock::now() + fault_time();
  while (std::chrono::steady_clock::now() < end && !HasFatalFailure()) {
    std::unique_ptr<SharedLife>& life = lives[below(2)];
    switch (below(8)) {
      case 0:
        // Without RouDi's watch, iceoryx has 512 publishers and 300 processes, dead or alive.
        if (++deaths > 100) break;
        life->kill();
        restart(life);
        break;
      case 1:
        life->stop();
        traffic.publish(20);
        std::this_thread::sleep_for(std::chrono::milliseconds(below(300)));
        life->resume();
        break;
      default:
        const std::uint32_t times = 1 + below(20);
        traffic.send(*life, times);
        traffic.publish(times);
    }
  }
  EXPECT_GT(deaths, 0);
  const auto all = static_cast<std::uint64_t>(traffic.sent);
  EXPECT_TRUE(stays.has("/in", all));
  expect_complete(stays.received("/in"), all);
  for (const auto& life : lives) {
    ASSERT_TRUE(
        eventually([&] { return life->subscriber.received("/out").last == traffic.published; }));
    const Received theirs = life->subscriber.received("/out");
    expect_complete(theirs, theirs.expected);
  }
  expect_flat(before, footprint(stays.pid()));
}

TEST_F(BySharedMemory, RoudiIsNotUsedWhileItIsStopped) {
  start_roudi();
  kill(roudi_->pid(), SIGSTOP);
  ASSERT_TRUE(eventually([] { return !find_roudi().unusable.empty(); }));
  EXPECT_THAT(Peer("require").greeting(), HasSubstr("RouDi is stopped"));
  kill(roudi_->pid(), SIGCONT);
  ASSERT_TRUE(eventually([] { return find_roudi().unusable.empty(); }));
  EXPECT_EQ(Peer("require").greeting(), "ok");
}

TEST_F(BySharedMemory, RoudiThatWatchesItsClientsIsNotUsed) {
  const pid_t roudi = fork();
  if (roudi == 0) {
    execlp("iox-roudi", "iox-roudi", "-l", "off", nullptr);
    _exit(127);
  }
  EXPECT_TRUE(eventually([&] {
    return find_roudi().pid == roudi && find_roudi().unusable.starts_with("RouDi watches");
  })) << find_roudi().unusable;
  kill(roudi, SIGTERM);
  waitpid(roudi, nullptr, 0);
}

TEST_F(BySharedMemory, RoudiLeavesNothingBehind) {
  start_roudi();
  EXPECT_EQ(find_roudi().pid, roudi_->pid());
  EXPECT_EQ(find_roudi().unusable, "");
  EXPECT_EQ(find_roudi().largest_message, 5'000'016u);
  roudi_.reset();
  EXPECT_EQ(find_roudi().unusable, "RouDi is not running");
  for (const char* file : {"/tmp/roudi", "/dev/shm/iceoryx_mgmt"}) {
    EXPECT_FALSE(std::filesystem::exists(file)) << file;
  }
}

}  // namespace
}  // namespace takt
