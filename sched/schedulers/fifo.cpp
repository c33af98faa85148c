// First come, first served: the order in which messages were published and timers came due.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <vector>

#include "takt/sched/keyed_heap.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

// A ring holds callbacks that are pushed in order of arrival, as nearly all are. A heap holds the
// others: those that a busy group gave back, and those that a message of another thread overtook.
class FifoScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    ring_.resize(std::bit_ceil(std::max<std::size_t>(callbacks.size(), 1)));
    late_.resize(callbacks.size());
  }
  void push(ReadyCallback& callback) noexcept override {
    if (begin_ != end_ && callback.sequence < last_sequence_) [[unlikely]]
      return push_late(callback);
    last_sequence_ = callback.sequence;
    at(end_++) = &callback;
  }
  ReadyCallback* pop() noexcept override {
    if (!late_.empty()) [[unlikely]]
      return pop_where_some_are_late();
    return begin_ != end_ ? at(begin_++) : nullptr;
  }
  ReadyCallback* peek() noexcept override {
    if (!late_.empty() && is_late_next()) [[unlikely]]
      return late_.peek();
    return begin_ != end_ ? at(begin_) : nullptr;
  }

 private:
  [[gnu::noinline]] void push_late(ReadyCallback& callback) noexcept {
    late_.push(callback.sequence, callback);
  }
  [[gnu::noinline]] ReadyCallback* pop_where_some_are_late() noexcept {
    return is_late_next() ? late_.pop() : at(begin_++);
  }
  bool is_late_next() noexcept { return begin_ == end_ || late_.first() <= at(begin_)->sequence; }
  ReadyCallback*& at(std::size_t position) noexcept { return ring_[position & (ring_.size() - 1)]; }

  std::vector<ReadyCallback*> ring_;  // sized in configure
  std::uint64_t last_sequence_ = 0;   // of the last callback put into the ring
  std::size_t begin_ = 0, end_ = 0;   // of the ring, modulo its size
  KeyedHeap<std::uint64_t> late_;     // by sequence
};

}  // namespace
TAKT_REGISTER_SCHEDULER("fifo", "order of arrival", FifoScheduler, .uses_time = false,
                        .order = analysis::Order::by_arrival)
}  // namespace takt
