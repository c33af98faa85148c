// What users add to Takt: a component and a scheduler, in a system that a file describes. Ends when
// a message has come.
// SPDX-License-Identifier: Apache-2.0
#include <semaphore>

#include "takt/containers/container.hpp"
#include "takt/sched/scheduler.hpp"

namespace consumer {

struct NewestFirst {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return a.sequence > b.sequence;
  }
};
using NewestFirstScheduler = takt::HeapScheduler<NewestFirst>;
TAKT_REGISTER_SCHEDULER("newest_first", "the contrary of fifo", NewestFirstScheduler,
                        .uses_time = false)

struct Count {
  int number = 0;
};
TAKT_MESSAGE(Count, "consumer/msg/Count", number);

std::binary_semaphore arrived{0};

class Counter : public takt::Node {
 public:
  explicit Counter(const takt::NodeOptions& options)
      : Node("counter", options),
        publisher_(create_publisher<Count>("count", 10)),
        subscription_(create_subscription<Count>("count", 10,
                                                 [this](const Count&) {
                                                   if (!released_) arrived.release();
                                                   released_ = true;
                                                 })),
        timer_(create_timer("tick", std::chrono::milliseconds(1),
                            [this] { publisher_->publish(Count{++number_}); })) {}

 private:
  int number_ = 0;
  bool released_ = false;
  const std::shared_ptr<takt::Publisher<Count>> publisher_;
  const std::shared_ptr<takt::Subscription<Count>> subscription_;
  const std::shared_ptr<takt::Timer> timer_;
};

}  // namespace consumer

TAKT_REGISTER_COMPONENT(consumer::Counter, "sends numbers to itself")

int main(int, char** arguments) {
  takt::Container container(takt::read_system(arguments[1]));
  container.start();
  container.release();
  consumer::arrived.acquire();
  container.hold();
  container.stop();
  return container.result().callbacks.size() == 2 ? 0 : 1;
}
