// A process that does what one killed in the middle of iceoryx's work has done, for
// shared_memory_faults_test.cpp. It speaks iceoryx and no DDS. Its standard input begins with one
// line; it says "ok" when that is done, and waits to be killed.
//   DOMAIN TOPIC roudi     holds a lock that RouDi needs soon
//   DOMAIN TOPIC reader    holds the lock of the topic's first subscription
//   DOMAIN TOPIC flood N   sends N messages, of a publisher that DDS does not know
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <iostream>
#include <string>
#include <thread>

#include <dds/ddsi/ddsi_shm_transport.h>
#include <iceoryx_posh/internal/popo/ports/publisher_port_user.hpp>
#include <iceoryx_posh/internal/popo/ports/subscriber_port_user.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>
#include <unistd.h>

namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kBlockBytes = 1064;  // a test_msgs/msg/Block behind our header

template <class Condition>
void wait_for(Condition&& condition) {
  while (!condition()) std::this_thread::sleep_for(1ms);
}

iox::capro::ServiceDescription service(const std::string& domain, const std::string& topic) {
  const auto text = [](const std::string& word) {
    return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, word);
  };
  return {text("takt_" + domain), text("test_msgs::msg::dds_::Block_"), text("rt" + topic)};
}

int run() {
  std::string domain, topic, command;
  std::cin >> domain >> topic >> command;
  auto& runtime = iox::runtime::PoshRuntime::initRuntime(
      {iox::cxx::TruncateToCapacity, "iceoryx_rt_" + std::to_string(getpid()) + "_rogue"});
  auto* const data = runtime.getMiddlewarePublisher(service(domain, topic));
  iox::popo::PublisherPortUser publisher(data);
  publisher.offer();
  if (command == "roudi") {
    wait_for([&] { return publisher.isOffered(); });
    data->m_chunkSenderData.lock();
    std::cout << "ok" << std::endl;
    // RouDi needs its lock to join this subscriber to the publisher: so it does not answer this
    // call either.
    iox::popo::SubscriberPortUser subscriber(
        runtime.getMiddlewareSubscriber(service(domain, topic)));
    subscriber.subscribe();
    pause();
  }
  wait_for([&] { return publisher.hasSubscribers(); });
  if (command == "reader") data->m_chunkSenderData.m_queues.front()->lock();
  int messages = 0;
  if (command == "flood") std::cin >> messages;
  for (int i = 0; i < messages; ++i) {
    std::this_thread::sleep_for(1ms);
    publisher.tryAllocateChunk(kBlockBytes, 8, sizeof(iceoryx_header_t), alignof(iceoryx_header_t))
        .and_then([&](auto& chunk) { publisher.sendChunk(chunk); });
  }
  std::cout << "ok" << std::endl;
  pause();
  return 0;
}

}  // namespace

int main() {
  return run();
}
