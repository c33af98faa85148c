// A service and its client: an answer, and a call that nobody answers.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/takt.hpp"

struct Add {
  struct Request {
    std::int64_t a = 0, b = 0;
  };
  struct Response {
    std::int64_t sum = 0;
  };
};
// The names that ROS 2 gives to the two messages of example_interfaces/srv/AddTwoInts.
TAKT_MESSAGE(Add::Request, "example_interfaces/srv/AddTwoInts_Request", a, b);
TAKT_MESSAGE(Add::Response, "example_interfaces/srv/AddTwoInts_Response", sum);

int main() {
  using namespace std::chrono_literals;
  const auto executor = takt::executors().make("events", {});
  const auto calculator = std::make_shared<takt::Node>("calculator");
  const auto asker = std::make_shared<takt::Node>("asker");
  const auto service = calculator->create_service<Add>(
      "add", [](const Add::Request& request, Add::Response& response) {
        response.sum = request.a + request.b;
      });
  const auto client = asker->create_client<Add>("add");
  const auto lonely = asker->create_client<Add>("nobody", {.timeout = 50ms});
  executor->add_node(calculator);
  executor->add_node(asker);

  // The callback runs under the executor; nullptr says that there is no answer.
  client->async_send_request(
      {1, 2}, [](const Add::Response* response) { fmt::print("1 + 2 = {}\n", response->sum); });
  lonely->async_send_request({1, 2}, [&](const Add::Response* response) {
    fmt::print("nobody: {}\n", response == nullptr ? "no answer in 50 ms" : "an answer?");
    executor->cancel();
  });
  executor->spin();

  // Or as a future, on which the executor's own thread waits while it serves.
  const auto answer = client->async_send_request({3, 4});
  executor->spin_until_future_complete(answer);
  fmt::print("3 + 4 = {}\n", answer.get()->sum);
}
