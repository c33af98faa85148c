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

namespace {

using namespace takt;

std::shared_ptr<Node> make_node(const std::string& name) {
  NodeOptions options;
  options.participant = Participant::create({.domain = 0});
  return std::make_shared<Node>(name, options);
}

class Host {
 public:
  Host(std::string own, std::string other)
      : own_(std::move(own)), other_(std::move(other)), node_(make_node(own_)) {
    executor_->add_node(node_);
    spinning_ = std::thread([this] { executor_->spin(); });
  }
  ~Host() {
    executor_->cancel();
    spinning_.join();
  }

  bool is_ready() {
    return publisher_->subscription_count() == 1 && hasty_->subscription_count() == 1 &&
           subscription_->outside_publisher_count() == 1 &&
           hasty_subscription_->outside_publisher_count() == 1 && client_->service_is_ready();
  }
  /// The number of the last message.
  std::int64_t publish(std::size_t count, std::size_t bytes) {
    for (; count != 0; --count) {
      const Numbered message{++number_, std::vector<std::byte>(bytes)};
      publisher_->publish(message);
      hasty_->publish(message);
    }
    return number_;
  }
  /// "MESSAGES GAPS BEST_EFFORT_MESSAGES".
  std::string received() {
    const std::lock_guard lock(mutex_);
    std::ostringstream text;
    text << received_ << ' ' << gaps_ << ' ' << received_best_effort_;
    return text.str();
  }
  /// What the other host answers; -1: it does not.
  std::int64_t call(std::int64_t value) {
    std::promise<std::int64_t> answer;
    client_->async_send_request({.value = value}, [&](const Echo::Response* response) {
      answer.set_value(response != nullptr ? response->value : -1);
    });
    return answer.get_future().get();
  }

 private:
  void receive(const Numbered& message) {
    const std::lock_guard lock(mutex_);
    ++received_;
    if (message.number != last_ + 1) ++gaps_;
    last_ = message.number;
  }

  const std::string own_, other_;
  const QoS all_{3000};
  std::int64_t number_ = 0;
  std::mutex mutex_;  // guards the next two lines
  std::int64_t last_ = 0;
  std::size_t received_ = 0, gaps_ = 0, received_best_effort_ = 0;
  const std::shared_ptr<Node> node_;
  const std::shared_ptr<Publisher<Numbered>> publisher_ =
      node_->create_publisher<Numbered>(own_, all_);
  const std::shared_ptr<Publisher<Numbered>> hasty_ =
      node_->create_publisher<Numbered>(own_ + "/hasty", QoS(all_).best_effort());
  const std::shared_ptr<Subscription<Numbered>> subscription_ =
      node_->create_subscription<Numbered>(other_, all_,
                                           [this](const Numbered& message) { receive(message); });
  const std::shared_ptr<Subscription<Numbered>> hasty_subscription_ =
      node_->create_subscription<Numbered>(other_ + "/hasty", QoS(all_).best_effort(),
                                           [this](const Numbered&) {
                                             const std::lock_guard lock(mutex_);
                                             ++received_best_effort_;
                                           });
  const std::shared_ptr<Service<Echo>> service_ = node_->create_service<Echo>(
      own_, [](const Echo::Request& request, Echo::Response& response) { response = request; });
  const std::shared_ptr<Client<Echo>> client_ =
      node_->create_client<Echo>(other_, {.timeout = std::chrono::seconds(30)});
  const std::unique_ptr<Executor> executor_ = executors().make("events", {});
  std::thread spinning_;
};

}  // namespace

int main(int, char** argv) {
  loss = argv[3];
  Host host(argv[1], argv[2]);
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "ready") {
      std::cout << host.is_ready();
    } else if (command == "publish") {
      std::size_t count = 0, bytes = 0;
      words >> count >> bytes;
      std::cout << host.publish(count, bytes);
    } else if (command == "received") {
      std::cout << host.received();
    } else if (command == "call") {
      std::int64_t value = 0;
      words >> value;
      std::cout << host.call(value);
    }
    std::cout << std::endl;
  }
}
