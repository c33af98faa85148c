// Libraries that are built with -fvisibility=hidden share types, registries and exceptions with
// each other and with a program.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/visibility_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/sched/scheduler_library.hpp"

namespace takt {
namespace {

using testing::StartsWith;

std::shared_ptr<Node> make_component(const std::string& name, const char* library) {
  find_component(name, library);
  return components().make(name, {})->node;
}

TEST(Visibility, LibrariesThatExportNothingShareMessagesRegistriesAndErrors) {
  load_scheduler("of_the_talker", TAKT_HIDDEN_TALKER);
  load_executor("of_the_talker", TAKT_HIDDEN_TALKER);
  const auto talker = make_component("hidden::Talker", TAKT_HIDDEN_TALKER);
  const auto listener = make_component("hidden::Listener", TAKT_HIDDEN_LISTENER);
  const auto node = std::make_shared<Node>("reader");
  const auto executor = executors().make("single_threaded", {});
  std::string answer;
  const auto subscription =
      node->create_subscription<hidden::Answer>("answer", 10, [&](const hidden::Answer& message) {
        answer = message.text;
        executor->cancel();
      });
  executor->add_node(talker);
  executor->add_node(listener);
  executor->add_node(node);
  executor->spin();
  EXPECT_THAT(answer, StartsWith("42 degrees, ba, no scheduler is called 'of_nobody'"));
}

TEST(Visibility, TheProgramCastsAndCatchesTypesOfTheLibrary) {
  EXPECT_NE(std::dynamic_pointer_cast<LifecycleNode>(
                make_component("hidden::Listener", TAKT_HIDDEN_LISTENER)),
            nullptr);
  EXPECT_THROW(make_component("hidden::Refuser", TAKT_HIDDEN_TALKER), Error);
}

}  // namespace
}  // namespace takt
