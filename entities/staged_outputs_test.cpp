// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/staged_outputs.hpp"

#include <gtest/gtest.h>

#include "takt/nodes/node.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

// A message that went with the locks held waited for itself.
TEST(StagedOutputs, AMessageOfAPublisherThatGoesMayOwnAnotherPublisher) {
  const auto node = std::make_shared<Node>("node");
  auto one = node->create_publisher<Labelled>("one", 5);
  auto other = node->create_publisher<Labelled>("other", 5);
  StagedOutputs outputs(4);
  Dispatch dispatch{.callback = nullptr, .chain_instance = 0, .root_release = {}, .path = 0};
  dispatch.outputs = &outputs;
  {
    const Dispatch::Scope scope(dispatch);
    one->publish(std::shared_ptr<const Labelled>(new Labelled, [&](const Labelled* message) {
      delete message;
      other.reset();
    }));
  }
  one.reset();
  EXPECT_EQ(other, nullptr);
  EXPECT_EQ(outputs.size(), 0u);
}

}  // namespace
}  // namespace takt
