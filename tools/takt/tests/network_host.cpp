// One host of network_test.py. It publishes "/NAME", to all that know it reliably and not, reads
// "/OTHER", serves "/NAME" and calls "/OTHER".
//   usage: network_host NAME OTHER LOSS: of a thousand datagrams it loses so many
//   lines: ready | publish COUNT BYTES | received | call NUMBER
// SPDX-License-Identifier: Apache-2.0
#include <future>
#include <iostream>
#include <mutex>
#include <sstream>
#include <thread>

#include <dds/dds.h>
#include <dlfcn.h>

#include "takt/executors/executor.hpp"

namespace {

struct Numbered {
  std::int64_t number = 0;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(Numbered, "test_msgs/msg/Numbered", number, data);

struct Echo {
  struct Request {
    std::int64_t value = 0;
  };
  using Response = Request;
};
TAKT_MESSAGE(Echo::Request, "test_msgs/srv/Echo_Request", value);

std::string loss;

}  // namespace

// Takes the place of Cyclone's for libtakt, which has no word for losses. No kernel module is
// needed for these, and they hit what is sent, acknowledgements and discovery too.
extern "C" dds_entity_t dds_create_domain(const dds_domainid_t domain, const char* config) {
  const auto cyclones =
      reinterpret_cast<decltype(&dds_create_domain)>(dlsym(RTLD_NEXT, "dds_create_domain"));
  const std::string lossy = std::string(config) +
                            ",<CycloneDDS><Domain><Internal><Test><XmitLossiness>" + loss +
                            "</XmitLossiness></Test></Internal></Domain></CycloneDDS>";
  return cyclones(domain, lossy.c_str());
}

int main(int, char** argv) {
  using namespace takt;
  const std::string own = argv[1], other = argv[2];
  loss = argv[3];
  NodeOptions options;
  options.participant = Participant::create({.domain = 0, .loopback_only = false});
  const auto node = std::make_shared<Node>(own, options);

  std::mutex mutex;  // guards the next three
  std::int64_t last = 0;
  std::size_t received = 0, gaps = 0, received_best_effort = 0;
  const QoS all(3000);
  const auto publisher = node->create_publisher<Numbered>(own, all);
  const auto hasty = node->create_publisher<Numbered>(own + "/hasty", QoS(all).best_effort());
  const auto subscription =
      node->create_subscription<Numbered>(other, all, [&](const Numbered& message) {
        const std::lock_guard lock(mutex);
        ++received;
        if (message.number != last + 1) ++gaps;
        last = message.number;
      });
  const auto hasty_subscription = node->create_subscription<Numbered>(
      other + "/hasty", QoS(all).best_effort(), [&](const Numbered&) {
        const std::lock_guard lock(mutex);
        ++received_best_effort;
      });
  const auto service = node->create_service<Echo>(
      own, [](const Echo::Request& request, Echo::Response& response) { response = request; });
  const auto client = node->create_client<Echo>(other, {.timeout = std::chrono::seconds(30)});
  const auto executor = executors().make("events", {});
  executor->add_node(node);
  std::thread spinning([&] { executor->spin(); });

  std::int64_t number = 0;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "ready") {
      std::cout << (publisher->subscription_count() == 1 && hasty->subscription_count() == 1 &&
                    subscription->outside_publisher_count() == 1 &&
                    hasty_subscription->outside_publisher_count() == 1 &&
                    client->service_is_ready());
    } else if (command == "publish") {
      std::size_t count = 0, bytes = 0;
      words >> count >> bytes;
      for (; count != 0; --count) {
        const Numbered message{++number, std::vector<std::byte>(bytes)};
        publisher->publish(message);
        hasty->publish(message);
      }
      std::cout << number;
    } else if (command == "received") {
      const std::lock_guard lock(mutex);
      std::cout << received << ' ' << gaps << ' ' << received_best_effort;
    } else if (command == "call") {
      Echo::Request request;
      words >> request.value;
      std::promise<std::int64_t> answer;
      client->async_send_request(request, [&](const Echo::Response* response) {
        answer.set_value(response != nullptr ? response->value : -1);
      });
      std::cout << answer.get_future().get();
    }
    std::cout << std::endl;
  }
  executor->cancel();
  spinning.join();
}
