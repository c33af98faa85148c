// A process that executes the commands from its standard input: the other side of
// transport_test.cpp. DOMAIN, then lines: create TOPIC DEPTH DURABILITY LIFESPAN_NS | publish TOPIC
// VALUE TEXT | matched TOPIC | drop TOPIC | subscribe TOPIC DEPTH | last TOPIC | gaps TOPIC | serve
// SERVICE | answer SERVICE | end SERVICE. "last" is the value that was received last, "gaps" how
// often it was not one more than before, "answer" waits for a call. It answers each line with one:
// "ok", or a number.
// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <map>
#include <sstream>

#include "takt/testing/peer_process.hpp"
#include "takt/testing/transport_messages.hpp"

namespace {

struct Received {
  std::shared_ptr<takt::Subscription<takt::Labelled>> subscription;
  std::int64_t last = 0;
  std::uint64_t gaps = 0;
  void take() {
    for (takt::Labelled message; subscription->take(message); last = message.value) {
      if (last != 0 && message.value != last + 1) ++gaps;
    }
  }
};

}  // namespace

int main() {
  using takt::Labelled;
  int domain = 0;
  std::cin >> domain;
  takt::NodeOptions options;
  options.participant = takt::Participant::create({.domain = domain});
  const auto node = std::make_shared<takt::Node>("peer", options);
  std::map<std::string, std::shared_ptr<takt::Publisher<Labelled>>> publishers;
  std::map<std::string, Received> subscriptions;
  std::map<std::string, std::shared_ptr<takt::Service<takt::Add>>> services;
  std::cout << "ok" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command, topic;
    if (!(words >> command >> topic)) continue;
    if (command == "create") {
      takt::QoS qos;
      std::string durability;
      std::int64_t lifespan_ns = 0;
      words >> qos.depth >> durability >> lifespan_ns;
      qos.lifespan(takt::Nanoseconds(lifespan_ns));
      if (durability == "transient_local") qos.transient_local();
      publishers[topic] = node->create_publisher<Labelled>(topic, qos);
    } else if (command == "publish") {
      Labelled message;
      words >> message.value >> message.label;
      publishers.at(topic)->publish(message);
    } else if (command == "matched") {
      std::cout << publishers.at(topic)->subscription_count() << std::endl;
      continue;
    } else if (command == "subscribe") {
      std::size_t depth = 0;
      words >> depth;
      subscriptions[topic].subscription =
          node->create_subscription<Labelled>(topic, depth, [](const Labelled&) {});
    } else if (command == "last" || command == "gaps") {
      Received& received = subscriptions.at(topic);
      received.take();
      std::cout << (command == "last" ? received.last : static_cast<std::int64_t>(received.gaps))
                << std::endl;
      continue;
    } else if (command == "serve") {
      services[topic] = node->create_service<takt::Add>(
          topic, [](const auto& request, auto& response) { response.sum = request.a + request.b; });
    } else if (command == "answer") {
      takt::Slot slot;
      if (!takt::eventually([&] { return services.at(topic)->take(slot); })) return 1;
      services.at(topic)->execute(slot);
    } else if (command == "end") {
      services.erase(topic);
    } else if (command == "drop") {
      publishers.erase(topic);
    }
    std::cout << "ok" << std::endl;
  }
}
