// SPDX-License-Identifier: Apache-2.0
#include "graph/service_call.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/structure.hpp"
#include "takt/testing/peer_process.hpp"

namespace takt::tools {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr const char* kStructure = "/_container/get_structure";

/// A container that says of itself what it likes.
class Stranger {
 public:
  Stranger() {
    executor_->add_node(node_);
    thread_ = std::thread([this] { executor_->spin(); });
  }
  ~Stranger() {
    executor_->cancel();
    thread_.join();
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  std::atomic<std::size_t> callbacks{0};

 private:
  const std::shared_ptr<Node> node_ = std::make_shared<Node>(
      "stranger", NodeOptions{.participant = Participant::create(
                                  {.domain = test_domain(), .shared_memory = SharedMemory::off})});
  const std::shared_ptr<Service<GetStructure>> service_ = node_->create_service<GetStructure>(
      std::string("~") + kStructure,
      [this](const auto&, auto& response) { response.structure.callbacks.resize(callbacks); });
  const std::unique_ptr<Executor> executor_ = executors().make("events", {});
  std::thread thread_;
};

TEST(Caller, ReadsNoAnswerOfMoreEntriesThanTheLimit) {
  Stranger stranger;
  Caller caller(test_domain());
  const auto ask_all = [&](std::size_t callbacks) {
    stranger.callbacks = callbacks;
    return caller.ask_all<GetStructure>({"stranger"}, kStructure, {}, kListLimit);
  };
  const auto ask = [&] {
    return caller.call<GetStructure>(service_of("stranger", kStructure), {}, "'stranger'");
  };
  const auto most = ask_all(kMostEntries);
  ASSERT_EQ(most.in_time.size(), 1u);
  EXPECT_EQ(most.in_time[0].second.structure.callbacks.size(), kMostEntries);
  EXPECT_EQ(ask().structure.callbacks.size(), kMostEntries);
  const auto more = ask_all(kMostEntries + 1);
  EXPECT_THAT(more.in_time, IsEmpty());
  EXPECT_THAT(more.silent, ElementsAre("stranger"));
  EXPECT_THAT(ask, ThrowsMessage<Error>(HasSubstr("a list of 10001 entries")));
}

}  // namespace
}  // namespace takt::tools
