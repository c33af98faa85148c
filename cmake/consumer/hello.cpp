// Two nodes and an executor: ends when a message has come.
// SPDX-License-Identifier: Apache-2.0
#include "takt/takt.hpp"

struct Greeting {
  int number = 0;
};
TAKT_MESSAGE(Greeting, "consumer/msg/Greeting", number);

int main() {
  using namespace std::chrono_literals;
  const auto executor = takt::executors().make("events", {});
  const auto talker = std::make_shared<takt::Node>("talker");
  const auto listener = std::make_shared<takt::Node>("listener");

  const auto publisher = talker->create_publisher<Greeting>("greeting", 10);
  const auto timer = talker->create_timer("tick", 1ms, [&] { publisher->publish(Greeting{1}); });
  const auto subscription = listener->create_subscription<Greeting>(
      "greeting", 10, [&](const Greeting&) { executor->cancel(); });

  executor->add_node(talker);
  executor->add_node(listener);
  executor->spin();
}
