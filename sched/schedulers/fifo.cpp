// First come, first served: the order in which messages were published and timers came due.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <vector>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

// What is pushed in order of arrival, as nearly everything is, waits in a ring. The rest waits in a
// heap: what a busy group gave back, and what another thread's message overtook. The number stands
// beside the pointer, as another worker may have had the record's cache line last.
class FifoScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    ring_.resize(std::bit_ceil(std::max<std::size_t>(callbacks.size(), 1)));
    late_.resize(callbacks.size());
  }
  void push(ReadyCallback& callback) noexcept override {
    const Waiting waiting{callback.sequence, &callback};
    if (begin_ == end_ || waiting.sequence > at(end_ - 1).sequence) {
      at(end_++) = waiting;
    } else {
      late_[late_size_++] = waiting;
      std::push_heap(late_.data(), late_.data() + late_size_, after);
    }
  }
  ReadyCallback* pop() noexcept override {
    const bool is_any_late = late_size_ != 0;
    if (begin_ != end_ && (!is_any_late || at(begin_).sequence < late_.front().sequence)) {
      return at(begin_++).callback;
    }
    if (!is_any_late) return nullptr;
    std::pop_heap(late_.data(), late_.data() + late_size_, after);
    return late_[--late_size_].callback;
  }
  bool is_order() const noexcept override { return true; }

 private:
  struct Waiting {
    std::uint64_t sequence;
    ReadyCallback* callback;
  };
  static bool after(const Waiting& a, const Waiting& b) noexcept { return a.sequence > b.sequence; }
  Waiting& at(std::size_t position) noexcept { return ring_[position & (ring_.size() - 1)]; }

  std::vector<Waiting> ring_, late_;  // as large as they will ever be
  std::size_t begin_ = 0, end_ = 0;   // of what is in the ring, modulo its size
  std::size_t late_size_ = 0;
};

}  // namespace
TAKT_REGISTER_SCHEDULER("fifo", "order of arrival", FifoScheduler, .uses_time = false,
                        .order = analysis::Order::by_arrival)
}  // namespace takt
