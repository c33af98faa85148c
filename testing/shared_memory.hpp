// A RouDi for tests, and peer processes that use it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_SHARED_MEMORY_HPP_
#define TAKT_TESTING_SHARED_MEMORY_HPP_

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "takt/testing/peer_process.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

namespace takt {

/// A peer's report about a publisher.
struct EndState {
  std::uint64_t messages = 0, uncopied = 0, lost = 0;
  std::string transport;
};
/// A peer's report about a subscription.
struct Received {
  std::uint64_t received = 0, lost = 0, expected = 0;
  std::int64_t last = 0;
  std::uint64_t broken = 0;
};

class Peer : public PeerProcess {
 public:
  explicit Peer(const std::string& mode = "auto")
      : PeerProcess(TAKT_SHARED_MEMORY_PEER, std::to_string(test_domain()) + " " + mode) {}
  EndState state(const std::string& topic) const {
    EndState state;
    std::istringstream words(ask("state " + topic));
    words >> state.messages >> state.uncopied >> state.lost >> std::ws;
    std::getline(words, state.transport);
    return state;
  }
  Received received(const std::string& topic) const {
    Received received;
    std::istringstream words(ask("received " + topic));
    words >> received.received >> received.lost >> received.expected >> received.last >>
        received.broken;
    return received;
  }
  /// Whether this many messages arrive, each in a callback or counted as lost.
  bool has(const std::string& topic, std::uint64_t count) const {
    return eventually([&] {
      const Received now = received(topic);
      return now.received + now.lost >= count;
    });
  }
};

class BySharedMemory : public testing::Test {
 protected:
  void SetUp() override {
    if (!RoudiProcess::is_installed()) GTEST_SKIP() << "iox-roudi is not installed";
    if (find_roudi().pid != 0) GTEST_SKIP() << "another RouDi runs";
  }
  /// Memory for 1 KB and 5 MB messages of a few endpoints.
  void start_roudi() {
    roudi_ = std::make_unique<RoudiProcess>(
        std::vector<ChunkPool>{{1024, 500}, {5'000'016, 2 * kChunksOfWriter + 12}});
  }
  /// Creates a publisher and a subscription, and waits until they match.
  static void match(const Peer& from, const Peer& to, const std::string& type,
                    const std::string& topic, std::size_t depth = 10) {
    ASSERT_EQ(to.ask("subscription " + type + " " + topic + " " + std::to_string(depth)), "ok");
    ASSERT_EQ(from.ask("publisher " + type + " " + topic + " " + std::to_string(depth)), "ok");
    ASSERT_TRUE(eventually([&] { return from.ask("matched " + topic) == "1"; }));
    // Wait for both sides: messages by shared memory from an undiscovered publisher are lost.
    ASSERT_TRUE(eventually([&] { return to.ask("heard " + topic) == "1"; }));
  }

  std::unique_ptr<RoudiProcess> roudi_;
};

}  // namespace takt

#endif  // TAKT_TESTING_SHARED_MEMORY_HPP_
