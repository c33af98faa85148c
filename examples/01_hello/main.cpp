// Two nodes and an executor that is chosen by a word: ./hello events
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include "takt/takt.hpp"

struct Greeting {
  int number = 0;
};
TAKT_MESSAGE(Greeting, "hello/msg/Greeting", number);

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  const auto executor = takt::executors().make(argc > 1 ? argv[1] : "single_threaded", {});
  const auto talker = std::make_shared<takt::Node>("talker");
  const auto listener = std::make_shared<takt::Node>("listener");

  const auto publisher = talker->create_publisher<Greeting>("greeting", 10);
  int count = 0;
  const auto timer =
      talker->create_timer("tick", 100ms, [&] { publisher->publish(Greeting{++count}); });
  const auto subscription =
      listener->create_subscription<Greeting>("greeting", 10, [&](const Greeting& greeting) {
        fmt::print("hello {}\n", greeting.number);
        if (greeting.number == 5) executor->cancel();
      });

  executor->add_node(talker);
  executor->add_node(listener);
  executor->spin();
}
