// A process that executes the commands from its standard input, for shared_memory_test.cpp and for
// measuring. It answers each line with one.
//   DOMAIN auto|require|off                 ok, or what Participant::create threw
//   publisher|subscription block|image|text TOPIC DEPTH
//   publish|copy TOPIC VALUE [TIMES PERIOD_US]   from a loan, or by const reference
//   borrow TOPIC TIMES                      keeps loans; answers how many it got
//   return TOPIC                            returns them
//   keep|check|forget TOPIC                 callbacks keep messages; how many are as they were
//   matched|heard|state|received|latency|drop TOPIC    heard: how many publishers are known
//   exit                                    ends, and destroys all with what has static storage
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <map>
#include <mutex>
#include <semaphore>
#include <set>
#include <sstream>
#include <thread>

#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

struct Block {
  std::int64_t value = 0, sent_ns = 0;
  std::array<std::uint8_t, 1008> data{};
};
TAKT_MESSAGE(Block, "test_msgs/msg/Block", value, sent_ns, data);

struct Image {
  std::int64_t value = 0, sent_ns = 0;
  std::array<std::uint8_t, 5'000'000> data{};
};
TAKT_MESSAGE(Image, "test_msgs/msg/Image", value, sent_ns, data);

struct Text {
  std::int64_t value = 0, sent_ns = 0;
  std::vector<std::uint8_t> data;
};
TAKT_MESSAGE(Text, "test_msgs/msg/Text", value, sent_ns, data);

std::int64_t now_ns() {
  return Clock::steady().now().time_since_epoch().count();
}

// The ends of the content, as checking a whole image would take longer than sending it.
template <class T>
void fill(T& message, std::int64_t value) {
  message.value = value;
  if (!message.data.empty())
    message.data.front() = message.data.back() = static_cast<std::uint8_t>(value);
}
template <class T>
bool is_sound(const T& message) {
  return message.data.empty() || (message.data.front() == (message.value & 0xff) &&
                                  message.data.back() == (message.value & 0xff));
}

/// A publisher or subscription that a command has made.
class End {
 public:
  virtual ~End() = default;
  virtual std::string handle(const std::string& command, std::istream& words) = 0;
  virtual void call_back() {}
};

template <class T>
class Sender final : public End {
 public:
  Sender(Node& node, const std::string& topic, std::size_t depth)
      : publisher_(node.create_publisher<T>(topic, depth, {.loans = 16})) {}

  std::string handle(const std::string& command, std::istream& words) override {
    if (command == "matched") return std::to_string(publisher_->subscription_count());
    if (command == "return") return loans_.clear(), "ok";
    if (command == "borrow") {
      std::size_t times = 0;
      words >> times;
      while (times-- > 0) {
        if (auto loan = publisher_->borrow_loaned_message()) loans_.push_back(std::move(loan));
      }
      return std::to_string(loans_.size());
    }
    std::int64_t value = 0, times = 1, period_us = 0;
    words >> value >> times >> period_us;
    if (!words) times = 1;
    for (std::int64_t i = 0; i < times; ++i) {
      if (period_us != 0) std::this_thread::sleep_for(std::chrono::microseconds(period_us));
      if (command == "copy") {
        const auto message = std::make_unique<T>();
        fill(*message, value + i);
        message->sent_ns = now_ns();
        publisher_->publish(*message);
      } else {
        auto loan = publisher_->borrow_loaned_message();
        if (!loan) return "no loan";
        fill(*loan, value + i);
        loan->sent_ns = now_ns();
        publisher_->publish(std::move(loan));
      }
    }
    return "ok";
  }

 private:
  std::shared_ptr<Publisher<T>> publisher_;
  std::vector<LoanedMessage<T>> loans_;
};

template <class T>
class Receiver final : public End, ArrivalListener {
 public:
  Receiver(Node& node, const std::string& topic, std::size_t depth,
           std::counting_semaphore<>& arrivals)
      : arrivals_(arrivals),
        subscription_(node.create_subscription<T>(
            topic, depth, [this](const std::shared_ptr<const T>& message) { receive(message); })) {
    subscription_->set_listener(this);
  }
  ~Receiver() override {
    if (subscription_ != nullptr) subscription_->set_listener(nullptr);
  }

  std::string handle(const std::string& command, std::istream&) override {
    if (command == "keep") return keeps_ = true, "ok";
    if (command == "forget") return kept_.clear(), "ok";
    if (command == "check") {
      return std::to_string(std::count_if(kept_.begin(), kept_.end(),
                                          [](const auto& message) { return is_sound(*message); }));
    }
    if (command == "drop") return subscription_.reset(), "ok";
    if (command == "heard") return std::to_string(subscription_->outside_publisher_count());
    std::ostringstream answer;
    if (command == "latency") {
      std::sort(latency_ns_.begin(), latency_ns_.end());
      for (const double share : {0.5, 0.9, 0.99}) {
        answer << static_cast<double>(latency_ns_.at(
                      static_cast<std::size_t>(share * static_cast<double>(latency_ns_.size())))) /
                      1e3
               << ' ';
      }
    } else {
      answer << received_ << ' ' << subscription_->lost() << ' ' << subscription_->expected() << ' '
             << last_ << ' ' << broken_;
    }
    return answer.str();
  }

  void call_back() override {
    for (Slot slot; subscription_ != nullptr && subscription_->take(slot);) {
      subscription_->execute(slot);
    }
  }

 private:
  void announce(const Arrival&) noexcept override { arrivals_.release(); }

  void receive(const std::shared_ptr<const T>& message) {
    latency_ns_.push_back(now_ns() - message->sent_ns);
    ++received_;
    last_ = message->value;
    if (!is_sound(*message)) ++broken_;
    if (keeps_) kept_.push_back(message);
  }

  std::counting_semaphore<>& arrivals_;
  std::uint64_t received_ = 0, broken_ = 0;
  std::int64_t last_ = 0;
  bool keeps_ = false;
  std::vector<std::shared_ptr<const T>> kept_;
  std::vector<std::int64_t> latency_ns_;
  std::shared_ptr<Subscription<T>> subscription_;
};

const std::set<std::string> kOfReceiver{"received", "heard",  "latency", "keep",
                                        "check",    "forget", "drop"};

SharedMemory mode(const std::string& word) {
  return word == "require" ? SharedMemory::require
         : word == "off"   ? SharedMemory::off
                           : SharedMemory::automatic;
}

template <class T>
std::unique_ptr<End> make_end(bool is_publisher, Node& node, const std::string& topic,
                              std::size_t depth, std::counting_semaphore<>& arrivals) {
  if (is_publisher) return std::make_unique<Sender<T>>(node, topic, depth);
  return std::make_unique<Receiver<T>>(node, topic, depth, arrivals);
}

/// `words`: type, topic and depth.
std::unique_ptr<End> make_end(bool is_publisher, Node& node, std::istream& words,
                              std::string& topic, std::counting_semaphore<>& arrivals) {
  std::string type;
  std::size_t depth = 0;
  words >> type >> topic >> depth;
  const auto make = type == "block"   ? &make_end<Block>
                    : type == "image" ? &make_end<Image>
                                      : &make_end<Text>;
  return make(is_publisher, node, topic, depth, arrivals);
}

std::string state_of(const Participant& participant, const std::string& topic) {
  std::string answer = "ok";
  for (const EndpointState& state : participant.endpoints()) {
    if (state.topic != topic) continue;
    answer =
        fmt::format("{} {} {} {}", state.messages, state.uncopied, state.lost, state.transport);
  }
  return answer;
}

// Destroyed after the objects of main, as a program may keep its nodes in static storage.
std::shared_ptr<Node> static_node;
std::map<std::string, std::unique_ptr<End>> static_ends;

[[noreturn]] void exit_with(std::shared_ptr<Node> node,
                            std::map<std::string, std::unique_ptr<End>> ends) {
  static_node = std::move(node);
  static_ends = std::move(ends);
  std::exit(0);
}

int run() {
  DdsOptions dds;
  std::string word;
  std::cin >> dds.domain >> word;
  dds.shared_memory = mode(word);
  NodeOptions options;
  try {
    options.participant = Participant::create(dds);
  } catch (const Error& error) {
    std::cout << error.what() << std::endl;
    return 0;  // this is an answer, too
  }
  auto node = std::make_shared<Node>("peer", options);
  std::mutex mutex;  // guards `ends`, and held while a callback runs
  std::map<std::string, std::unique_ptr<End>> ends;
  std::counting_semaphore<> arrivals(0);
  std::atomic<bool> is_over = false;
  std::thread callbacks([&] {
    while (!is_over) {
      arrivals.acquire();
      const std::lock_guard lock(mutex);
      for (const auto& [topic, end] : ends) end->call_back();
    }
  });
  std::cout << "ok" << std::endl;

  bool exits = false;
  for (std::string line; !exits && std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command, topic, answer = "ok";
    if (!(words >> command)) continue;
    exits = command == "exit";
    try {
      if (command == "publisher" || command == "subscription") {
        const bool is_publisher = command == "publisher";
        auto end = make_end(is_publisher, *node, words, topic, arrivals);
        const std::lock_guard lock(mutex);
        ends[is_publisher ? topic : topic + "/in"] = std::move(end);
      } else if (words >> topic; exits) {
        continue;
      } else if (command == "state") {
        answer = state_of(*options.participant, topic);
      } else {
        const bool is_of_receiver = kOfReceiver.contains(command);
        std::unique_lock lock(mutex, std::defer_lock);
        if (is_of_receiver) lock.lock();
        answer = ends.at(is_of_receiver ? topic + "/in" : topic)->handle(command, words);
      }
    } catch (const std::exception& error) {
      answer = error.what();
    }
    std::cout << answer << std::endl;
  }
  is_over = true;
  arrivals.release();
  callbacks.join();
  options = {};
  if (exits) exit_with(std::move(node), std::move(ends));
  return 0;
}

}  // namespace
}  // namespace takt

int main() {
  return takt::run();
}
