// Rules and workers' policies for tests, and the fixture of these tests.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_KIT_KIT_TEST_HPP_
#define TAKT_EXECUTORS_KIT_KIT_TEST_HPP_

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {

/// Serves `even` and `odd` callbacks in windows of 10 ms that alternate.
class Windows final : public Rule {
 public:
  explicit Windows(const ExecutorOptions&) { looks = 0; }
  static int looks;

  std::uint64_t label(const NamedCallback& callback) const override {
    if (callback.is_called("node/refused")) throw Error("this rule refuses it");
    return callback.is_called("node/odd") ? 1 : 0;
  }
  void begin(TimePoint now) noexcept override { begin_ = now; }
  bool look(TimePoint now, const ReadyCallbacks&) noexcept override {
    ++looks;
    const auto window = static_cast<std::uint64_t>((now - begin_) / 10ms);
    end_ = begin_ + (window + 1) * 10ms;
    return std::exchange(window_, window) != window;
  }
  bool admits(const ReadyCallback&, std::uint64_t label) const noexcept override {
    return window_ % 2 == label;
  }
  TimePoint opens_at() const noexcept override { return end_; }

 private:
  TimePoint begin_{}, end_{};
  std::uint64_t window_ = 0;
};
inline int Windows::looks = 0;

/// Serves for at most 3 ms in each 10 ms.
class Budget final : public Rule {
 public:
  explicit Budget(const ExecutorOptions&) {}
  void begin(TimePoint now) noexcept override { refill_ = now; }
  bool look(TimePoint now, const ReadyCallbacks&) noexcept override {
    if (now < refill_) return false;
    left_ = 3ms;
    refill_ += ((now - refill_) / 10ms + 1) * 10ms;
    return false;
  }
  bool is_open() const noexcept override { return left_ > 0ms; }
  TimePoint opens_at() const noexcept override { return refill_; }
  void done(const ReadyCallback&, std::uint64_t, Nanoseconds time) noexcept override {
    left_ -= time;
  }

 private:
  Nanoseconds left_{0};
  TimePoint refill_{};
};

/// Callbacks of priority 10 and more on worker 0, the others on worker 1.
class TwoBands final : public WorkersPolicy {
 public:
  explicit TwoBands(const ExecutorOptions&) {}
  WorkerSet workers_of(const NamedCallback& callback,
                       std::span<const ThreadAttributes>) const override {
    if (callback.is_called("node/nowhere")) return 0;
    return callback.info.priority >= 10 ? 1 : 2;
  }
};

/// Each worker takes each callback.
class AnyOfTwo final : public WorkersPolicy {
 public:
  explicit AnyOfTwo(const ExecutorOptions&) {}
  WorkerSet workers_of(const NamedCallback&, std::span<const ThreadAttributes>) const override {
    return 3;
  }
};
class Kit : public ::testing::Test {
 protected:
  std::unique_ptr<Executor> make(const std::string& type, std::size_t threads = 1) {
    auto executor = executors().make(
        type, {.threads = std::vector<ThreadAttributes>(threads), .clock = &clock_});
    executor->add_node(node_);
    return executor;
  }
  int now_ms() const { return static_cast<int>(clock_.now().time_since_epoch() / 1ms) - begin_ms_; }
  std::shared_ptr<Subscription<Number>> subscribe(const std::string& topic, Nanoseconds work = 0ns,
                                                  int priority = 0) {
    const auto group = node_->create_callback_group(topic + std::to_string(++groups_),
                                                    CallbackGroupType::MutuallyExclusive);
    auto subscription = node_->create_subscription<Number>(
        topic, 9,
        [this, topic, work](const Number& number) {
          trace_.push_back(topic + std::to_string(number.value) + "@" + std::to_string(now_ms()));
          if (work != 0ns) clock_.work(work);
        },
        group);
    subscription->set_parameters({.priority = priority});
    return subscription;
  }
  void send(const std::string& topic, int value) {
    auto& publisher = publishers_[topic];
    if (publisher == nullptr) publisher = node_->create_publisher<Number>(topic, 9);
    publisher->publish(Number{value});
  }

  ManualClock clock_;
  int begin_ms_ = static_cast<int>(clock_.now().time_since_epoch() / 1ms);
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::map<std::string, std::shared_ptr<Publisher<Number>>> publishers_;
  std::vector<std::string> trace_;
  int groups_ = 0;
};

}  // namespace takt::conformance

#endif  // TAKT_EXECUTORS_KIT_KIT_TEST_HPP_
