// Messages from an interface file, msg/Reading.idl: ./messages
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/executors/executor.hpp"

#include "weather/msg/reading.hpp"

int main() {
  using namespace std::chrono_literals;
  using weather::msg::Quality;
  using weather::msg::Reading;
  const auto executor = takt::executors().make("events", {});
  const auto station = std::make_shared<takt::Node>("station");

  const auto publisher = station->create_publisher<Reading>("reading", 10);
  const auto timer = station->create_timer("tick", 10ms, [&] {
    publisher->publish(Reading().set__sensor("roof").set__last_ones({18.5, 19.0}));
  });
  const auto subscription =
      station->create_subscription<Reading>("reading", 10, [&](const Reading& reading) {
        fmt::print("{}: {} degrees, {} before, {}\n", reading.sensor.get(), reading.celsius,
                   reading.last_ones.back(), reading.quality == Quality::GOOD ? "good" : "bad");
        executor->cancel();
      });

  executor->add_node(station);
  executor->spin();
}
