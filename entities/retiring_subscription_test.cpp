// Tests of what other threads ask a subscription while it retires.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/entities/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Level {
  int metres = 0;
};
TAKT_MESSAGE(Level, "test_msgs/msg/Level", metres);

/// Other processes, as far as a subscription sees. Who asks for their writers is inside until the
/// end outside goes, or for 10 ms: time enough to destroy it too early.
class Elsewhere final : public Participant {
 public:
  std::atomic<bool> is_inside{false}, is_gone{false}, went_too_early{false};

  std::unique_ptr<RemoteWriter> create_writer(const Endpoint&,
                                              std::shared_ptr<EndpointEvents>) override {
    return nullptr;
  }
  std::unique_ptr<RemoteReader> create_reader(IntraProcessReader&) override {
    return std::make_unique<Reader>(*this);
  }
  bool serves_own_process() const noexcept override { return false; }
  const std::string& why_no_shared_memory() const noexcept override { return nothing_; }
  std::vector<EndpointState> endpoints() const override { return {}; }
  void add_node(const std::string&) override {}
  void remove_node(const std::string&) override {}
  Graph graph() override { return {}; }
  const std::vector<ThreadState>& threads() const noexcept override { return threads_; }

 private:
  struct Reader final : RemoteReader {
    explicit Reader(Elsewhere& of) : all(of) {}
    ~Reader() override {
      all.went_too_early.store(all.is_inside.load());
      all.is_gone.store(true);
    }
    std::size_t writer_count() const noexcept override {
      Elsewhere& of = all;
      of.is_inside.store(true);
      for (int i = 0; i < 100 && !of.is_gone.load(); ++i) std::this_thread::sleep_for(100us);
      of.is_inside.store(false);
      return 1;
    }
    std::uint64_t received() const noexcept override { return 7; }
    Elsewhere& all;
  };
  const std::string nothing_;
  const std::vector<ThreadState> threads_;
};

// A reentrant service that one callback drops is asked by another one that answers: the end outside
// was destroyed under its hands.
TEST(Subscription, LeavesNobodyInsideItsEndOutsideWhenItRetires) {
  const auto elsewhere = std::make_shared<Elsewhere>();
  Node node("node", {.participant = elsewhere});
  auto handle = node.create_subscription<Level>("level", 10, [](const Level&) {});
  const std::shared_ptr<Entity> kept = node.entities().front();  // as executors do
  std::thread asks([&asked = *handle] { asked.outside_publisher_count(); });
  while (!elsewhere->is_inside.load()) std::this_thread::yield();
  handle.reset();
  EXPECT_TRUE(elsewhere->is_gone);
  EXPECT_FALSE(elsewhere->went_too_early);
  asks.join();
}

// An executor reports of what is being removed. For the thread sanitizer.
TEST(Subscription, ReportsWhileItRetires) {
  const auto elsewhere = std::make_shared<Elsewhere>();
  Node node("node", {.participant = elsewhere});
  auto handle = node.create_subscription<Level>("level", 10, [](const Level&) {});
  const std::shared_ptr<Entity> kept = node.entities().front();
  std::atomic<bool> has_begun{false};
  std::thread reports([&] {
    EXPECT_EQ(kept->report().from_outside, 7u);
    has_begun.store(true);
    while (kept->report().from_outside != 0) {
    }
  });
  while (!has_begun.load()) std::this_thread::yield();
  handle.reset();
  reports.join();
}

}  // namespace
}  // namespace takt
