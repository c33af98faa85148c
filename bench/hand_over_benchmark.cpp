// How long does a message take from a thread to a callback on another CPU, and what does the wait
// for it cost? Senders post every so often; receivers wait asleep or spinning. The bare ones, a
// futex and a cache line, are the lower bounds. All alternate, in rounds of one run; of each round
// the median counts, and the quartiles of the rounds are shown.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <thread>

#include <benchmark/benchmark.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/executors/executor.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Parcel {
  TimePoint sent;
  std::array<std::byte, 56> payload{};
};
TAKT_MESSAGE(Parcel, "bench/msg/Parcel", payload);

constexpr int kRounds = 30, kPosts = 300;

long futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  return syscall(SYS_futex, &word, operation, value, nullptr, nullptr, 0);
}

/// One way to wait. A round is kPosts calls of `post`, while another thread is in `receive`.
class Receiver {
 public:
  explicit Receiver(std::string name) : name_(std::move(name)) { times_.reserve(kPosts); }
  virtual ~Receiver() = default;
  virtual void post() = 0;
  virtual void receive() = 0;

  const std::string& name() const { return name_; }
  int received() const { return received_.load(); }
  void begin() {
    times_.clear();
    received_.store(0);
  }
  void end() {
    std::nth_element(times_.begin(), times_.begin() + kPosts / 2, times_.end());
    medians_ns_.push_back(static_cast<double>(times_[kPosts / 2].count()));
  }
  /// Of each round.
  const std::vector<double>& medians_ns() const { return medians_ns_; }

 protected:
  /// Returns true after the last of the round.
  bool record(TimePoint sent) {
    times_.push_back(Clock::steady().now() - sent);
    const int received = received_.load(std::memory_order_relaxed) + 1;
    received_.store(received);
    return received == kPosts;
  }

 private:
  const std::string name_;
  std::vector<Nanoseconds> times_;
  std::vector<double> medians_ns_;
  alignas(64) std::atomic<int> received_{0};
};

class CacheLine final : public Receiver {
 public:
  CacheLine() : Receiver("cache_line") {}
  void post() override {
    sent_ = Clock::steady().now();
    number_.store(number_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  void receive() override {
    for (;;) {
      while (number_.load(std::memory_order_acquire) == last_) {
      }
      ++last_;
      if (record(sent_)) return;
    }
  }

 private:
  alignas(64) std::atomic<std::uint32_t> number_{0};
  TimePoint sent_;  // in the same line
  alignas(64) std::uint32_t last_ = 0;
};

class Futex final : public Receiver {
 public:
  Futex() : Receiver("futex") {}
  void post() override {
    sent_ = Clock::steady().now();
    word_.store(1);
    futex(word_, FUTEX_WAKE_PRIVATE, 1);
  }
  void receive() override {
    for (;;) {
      while (word_.exchange(0) == 0) futex(word_, FUTEX_WAIT_PRIVATE, 0);
      if (record(sent_)) return;
    }
  }

 private:
  alignas(64) std::atomic<std::uint32_t> word_{0};
  TimePoint sent_;
};

class Takt final : public Receiver {
 public:
  Takt(std::string name, const std::string& executor, Nanoseconds spin)
      : Receiver(std::move(name)) {
    ExecutorOptions options;
    options.statistics = StatisticsLevel::count;
    options.spin = spin;
    executor_ = executors().make(executor, options);
    node_ = std::make_shared<Node>(this->name());
    publisher_ = node_->create_publisher<Parcel>("~/parcels", 8, {.loans = 8});
    subscription_ =
        node_->create_subscription<Parcel>("~/parcels", 8, [this](const Parcel& parcel) {
          if (record(parcel.sent)) executor_->cancel();
        });
    executor_->add_node(node_);
  }
  void post() override {
    auto parcel = publisher_->borrow_loaned_message();
    parcel->sent = Clock::steady().now();
    publisher_->publish(std::move(parcel));
  }
  void receive() override { executor_->spin(); }

 private:
  std::shared_ptr<Executor> executor_;
  std::shared_ptr<Node> node_;
  std::shared_ptr<Publisher<Parcel>> publisher_;
  std::shared_ptr<Subscription<Parcel>> subscription_;
};

void hand_over(benchmark::State& state, const std::string& executor) {
  if (available_cpus().size() < 2) return state.SkipWithError("needs two CPUs");
  const Nanoseconds interval(1'000'000'000 / state.range(0));
  std::vector<std::unique_ptr<Receiver>> receivers;
  receivers.push_back(std::make_unique<Futex>());
  receivers.push_back(std::make_unique<CacheLine>());
  receivers.push_back(std::make_unique<Takt>("asleep", executor, 0us));
  receivers.push_back(std::make_unique<Takt>("spin_50us", executor, 50us));
  receivers.push_back(std::make_unique<Takt>("always", executor, kSpinAlways));

  std::atomic<int> turn{0};     // even: the sender's; odd: the waiter's
  Receiver* current = nullptr;  // nullptr in the waiter's turn: the end
  std::jthread waiter([&] {
    rt::stay_on(1);
    for (;; turn.notify_all()) {
      int now;
      while ((now = turn.load()) % 2 == 0) turn.wait(now);
      if (current == nullptr) return;
      current->receive();
      turn.fetch_add(1);
    }
  });
  const auto give_turn = [&](Receiver* receiver) {
    current = receiver;
    turn.fetch_add(1);
    turn.notify_all();
  };
  rt::stay_on(0);
  const auto wait_until = [](TimePoint time) {
    while (Clock::steady().now() < time) {
    }
  };
  for ([[maybe_unused]] auto _ : state) {
    for (int round = 0; round < kRounds; ++round) {
      for (const auto& receiver : receivers) {
        receiver->begin();
        give_turn(receiver.get());
        wait_until(Clock::steady().now() + 200us);  // it has begun to wait
        for (int post = 0; post < kPosts; ++post) {
          const TimePoint next = Clock::steady().now() + interval;
          receiver->post();
          while (receiver->received() <= post) {
          }
          wait_until(next);
        }
        for (int now; (now = turn.load()) % 2 != 0;) turn.wait(now);
        receiver->end();
      }
    }
  }
  give_turn(nullptr);
  for (const auto& receiver : receivers) {
    for (const auto& [name, fraction] :
         {std::pair{"_p25_ns", 0.25}, {"_ns", 0.5}, {"_p75_ns", 0.75}}) {
      state.counters[receiver->name() + name] = rt::quantile(receiver->medians_ns(), fraction);
    }
  }
}
void rates(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("hz")->Arg(30'000)->Arg(10'000)->Iterations(1)->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(hand_over, events, "events")->Apply(rates);
BENCHMARK_CAPTURE(hand_over, single_threaded, "single_threaded")->Apply(rates);

}  // namespace
}  // namespace takt
