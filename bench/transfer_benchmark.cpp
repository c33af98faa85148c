// What does it cost to transfer messages between threads? A thread sends as fast as back-pressure
// permits: it waits for a free message, so none is lost. Another one, on another CPU, receives.
// The rounds alternate: `boost`, a pool of messages and two of Boost's rings that carry pointers
// forth and back; `bare`, Takt's pool and ring alone; and an executor that sleeps or that spins
// while there is nothing. The first two spin. The counters are medians of the rounds:
// - <name>_ns: per message. <name>_sleeps: how often the receiver slept, per 1000 messages.
// - <name>_ratio: to `boost`, with its 95 % interval; <name>_of_bare: to `bare`.
// How long one message takes, hand_over_benchmark measures.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>
#include <boost/lockfree/spsc_queue.hpp>
#include <sys/resource.h>

#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/base/lockfree/pool.hpp"
#include "takt/base/spin_pause.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

struct Parcel {
  std::uint64_t number = 0;
  std::array<std::byte, 56> payload{};
};
TAKT_MESSAGE(Parcel, "bench/msg/Parcel", number, payload);

constexpr std::size_t kInFlight = 64;
constexpr std::uint64_t kMessages = 100'000;
constexpr int kRounds = 20;

/// One way to transfer messages 1 to kMessages. `send` and `receive` run on two threads.
class Stream {
 public:
  explicit Stream(std::string name) : name_(std::move(name)) {}
  virtual ~Stream() = default;
  virtual void send() = 0;
  virtual void receive() = 0;

  void run() {
    std::atomic<bool> go{false};
    std::jthread sender([&] {
      rt::stay_on(0);
      while (!go.load()) {
      }
      send();
    });
    rusage before{}, after{};
    getrusage(RUSAGE_THREAD, &before);
    const TimePoint start = Clock::steady().now();
    go.store(true);
    receive();
    const Nanoseconds elapsed = Clock::steady().now() - start;
    getrusage(RUSAGE_THREAD, &after);
    ns_.push_back(static_cast<double>(elapsed.count()) / kMessages);
    sleeps_.push_back(static_cast<double>(after.ru_nvcsw - before.ru_nvcsw) * 1000 / kMessages);
  }
  const std::string& name() const { return name_; }
  const std::vector<double>& ns() const { return ns_; }
  const std::vector<double>& sleeps() const { return sleeps_; }
  bool is_complete() const { return is_complete_; }

 protected:
  void check(std::uint64_t number, std::uint64_t expected) {
    if (number != expected) is_complete_ = false;
  }

 private:
  const std::string name_;
  std::vector<double> ns_, sleeps_;
  bool is_complete_ = true;
};

class Boost final : public Stream {
 public:
  Boost() : Stream("boost") {
    for (Block& block : pool_) empty_.push(&block.parcel);
  }
  void send() override {
    for (std::uint64_t number = 1; number <= kMessages; ++number) {
      Parcel* parcel;
      while (!empty_.pop(parcel)) spin_pause();
      parcel->number = number;
      full_.push(parcel);
    }
  }
  void receive() override {
    for (std::uint64_t number = 1; number <= kMessages; ++number) {
      Parcel* parcel;
      while (!full_.pop(parcel)) spin_pause();
      check(parcel->number, number);
      empty_.push(parcel);
    }
  }

 private:
  struct alignas(64) Block {
    Parcel parcel;
  };
  std::vector<Block> pool_{kInFlight};
  boost::lockfree::spsc_queue<Parcel*> full_{kInFlight}, empty_{kInFlight};
};

class Bare final : public Stream {
 public:
  Bare() : Stream("bare") {}
  void send() override {
    for (std::uint64_t number = 1; number <= kMessages; ++number) {
      Block* block;
      while ((block = pool_->acquire()) == nullptr) spin_pause();
      block->parcel.number = number;
      ring_.push(block, number, 0);
    }
  }
  void receive() override {
    for (std::uint64_t number = 1; number <= kMessages; ++number) {
      bool more;
      Block* block;
      while ((block = ring_.pop([](Block*) {}, more)) == nullptr) spin_pause();
      check(block->parcel.number, number);
      Pool<Block>::recycle(*block);
    }
  }

 private:
  struct alignas(64) Block : PoolNode<Block> {
    Parcel parcel;
  };
  PoolPtr<Block> pool_{Pool<Block>::create(kInFlight)};
  KeepLastRing<Block> ring_{kInFlight};
};

class Takt final : public Stream {
 public:
  Takt(std::string name, const std::string& executor, Nanoseconds spin) : Stream(std::move(name)) {
    ExecutorOptions options;
    options.statistics = StatisticsLevel::count;
    options.threads.resize(1);
    options.spin = spin;
    executor_ = executors().make(executor, options);
    node_ = std::make_shared<Node>(this->name());
    publisher_ = node_->create_publisher<Parcel>("~/parcels", kInFlight, {.loans = kInFlight});
    subscription_ =
        node_->create_subscription<Parcel>("~/parcels", kInFlight, [this](const Parcel& parcel) {
          check(parcel.number, last_ + 1);
          last_ = parcel.number;
          if (last_ == kMessages) executor_->cancel();
        });
    executor_->add_node(node_);
  }
  void send() override {
    for (std::uint64_t number = 1; number <= kMessages; ++number) {
      LoanedMessage<Parcel> parcel;
      while (!(parcel = publisher_->borrow_loaned_message())) spin_pause();
      parcel->number = number;
      publisher_->publish(std::move(parcel));
    }
  }
  void receive() override {
    last_ = 0;
    executor_->spin();
  }

 private:
  std::shared_ptr<Executor> executor_;
  std::shared_ptr<Node> node_;
  std::shared_ptr<Publisher<Parcel>> publisher_;
  std::shared_ptr<Subscription<Parcel>> subscription_;
  alignas(64) std::uint64_t last_ = 0;  // the receiver writes it for each message
};

void transfer(benchmark::State& state, const std::string& executor) {
  if (available_cpus().size() < 2) return state.SkipWithError("needs two CPUs");
  std::vector<std::unique_ptr<Stream>> streams;
  streams.push_back(std::make_unique<Boost>());
  streams.push_back(std::make_unique<Bare>());
  streams.push_back(std::make_unique<Takt>("asleep", executor, Nanoseconds(0)));
  streams.push_back(std::make_unique<Takt>("spinning", executor, kSpinAlways));
  rt::stay_on(1);
  for ([[maybe_unused]] auto _ : state) {
    for (const auto& stream : streams) stream->run();
  }
  for (const auto& stream : streams) {
    const auto report = [&](const std::string& name, const Stream& to) {
      const rt::Interval ratio = rt::paired_ratio(stream->ns(), to.ns());
      state.counters[stream->name() + name] = ratio.median;
      state.counters[stream->name() + name + "_low"] = ratio.low;
      state.counters[stream->name() + name + "_high"] = ratio.high;
    };
    state.counters[stream->name() + "_ns"] = rt::median(stream->ns());
    state.counters[stream->name() + "_sleeps"] = rt::median(stream->sleeps());
    report("_ratio", *streams[0]);
    report("_of_bare", *streams[1]);
    if (!stream->is_complete()) state.SkipWithError("messages were lost");
  }
}
BENCHMARK_CAPTURE(transfer, events, "events")->Iterations(kRounds)->UseRealTime();
BENCHMARK_CAPTURE(transfer, single_threaded, "single_threaded")->Iterations(kRounds)->UseRealTime();

}  // namespace
}  // namespace takt
