// Runs concurrent code through all interleavings of a few operations with a few preemptions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_EXPLORER_HPP_
#define TAKT_TESTING_EXPLORER_HPP_

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <ucontext.h>

// How it works:
// 1. The files under test are compiled once more, in the namespace takt_explored, where
//    std::atomic is a class of ours: a plain value that calls the explorer before each access.
// 2. The explorer runs the operations in contexts of one thread. At each access it chooses which
//    context goes on. It tries the choices one after the other, depth first, by running everything
//    again from the start, and allows a limited number of preemptions (a context that has ended or
//    blocks is followed by any other for free).
// 3. After each run the history is checked against what the file promises.
// Memory is sequentially consistent, unless a run allows delays: then so many stores that are not
// sequentially consistent may wait in a buffer of their context, in order, as x86 processors do,
// while it goes on. They reach memory at any time, at the latest with its next access that is; a
// run chooses the time where another context accesses the variable, as nobody sees it before. For
// that, stores of one context at a time to a variable may wait.
// Covered: every interleaving of the accesses, and every such delay, within these limits. Not
// covered: weaker memory (the thread sanitizer's task, and review's), more operations or
// preemptions than a test's scenarios, and spurious failures of weak swaps.
namespace takt_explored {

#if defined(__SANITIZE_THREAD__)
inline constexpr const char* kNoContexts = "the thread sanitizer does not know ucontext";
#else
inline constexpr const char* kNoContexts = nullptr;
#endif

class Explorer {
 public:
  using Bodies = std::vector<std::function<void()>>;
  static constexpr std::size_t kNobody = SIZE_MAX;

  /// Calls `begin`, runs what it returns, calls `end`, for every schedule. Returns how many.
  std::size_t explore(int preemptions, const std::function<Bodies()>& begin,
                      const std::function<void()>& end, int delays = 0) {
    std::size_t schedules = 0;
    do {
      bodies_ = begin();
      run(preemptions, delays);
      end();
      ++schedules;
    } while (next_schedule());
    return schedules;
  }

  /// An access to shared memory is about to happen: to this variable, or to any.
  static void point(const void* where = nullptr) {
    if (++steps > kMaxSteps) fail("an operation does not come to an end");
    if (running == nullptr) return;
    running->may_switch();
    running->may_write(where);
  }

  /// Which context runs; kNobody outside of a run.
  static std::size_t current() { return running == nullptr ? kNobody : running->current_; }
  /// The context does not go on before another wakes it.
  static void block() {
    Explorer& self = *running;
    const std::size_t blocked = self.current_;
    std::erase(self.runnable_, blocked);
    ++self.blocked_;
    swapcontext(&self.contexts_[blocked], &self.main_);
  }
  static void wake(std::size_t context) {
    running->runnable_.push_back(context);
    --running->blocked_;
  }
  /// The other context is preempted here and never goes on, if it has not ended.
  static void freeze(std::size_t context) { std::erase(running->runnable_, context); }
  /// As block, for a context that waits at a variable.
  static void wait_at(const void* where) {
    running->waiting_.emplace_back(where, running->current_);
    block();
  }
  static void wake_all_at(const void* where) {
    if (running == nullptr) return;
    std::erase_if(running->waiting_, [where](const auto& waiting) {
      if (waiting.first != where) return false;
      wake(waiting.second);
      return true;
    });
  }
  /// The context waits for others, so they go on, if they can.
  static void yield() {
    Explorer& self = *running;
    if (self.runnable_.size() < 2) return;
    std::rotate(self.runnable_.begin(),
                std::find(self.runnable_.begin(), self.runnable_.end(), self.current_) + 1,
                self.runnable_.end());
    const std::size_t from =
        std::exchange(self.current_, self.runnable_[self.choose(self.runnable_.size() - 1)]);
    swapcontext(&self.contexts_[from], &self.contexts_[self.current_]);
  }
  /// How many contexts of the last run have never ended: they blocked, and nothing woke them.
  std::size_t stuck() const { return blocked_; }

  /// The value of a variable as the running context sees it: its own delayed store, or nullptr.
  static const std::uint64_t* delayed(const void* where) {
    if (running == nullptr) return nullptr;
    const std::deque<Delayed>& buffer = running->buffers_[running->current_];
    const auto last = std::find_if(buffer.rbegin(), buffer.rend(),
                                   [where](const Delayed& entry) { return entry.where == where; });
    return last == buffer.rend() ? nullptr : &last->value;
  }
  /// Returns true if the store waits, and is done later.
  static bool delay(void* where, std::uint64_t value, std::size_t size) {
    if (running == nullptr) return false;
    std::deque<Delayed>& buffer = running->buffers_[running->current_];
    if (buffer.empty()) {  // what follows a store that waits, waits, too
      if (running->delays_left_ == 0 || running->choose(2) == 0) return false;
      --running->delays_left_;
    }
    for (const std::deque<Delayed>& other : running->buffers_) {
      if (&other != &buffer && find(other, where) != other.end()) {
        fail("stores of two contexts to one variable wait");
      }
    }
    buffer.push_back({where, value, size});
    return true;
  }
  /// The running context's stores reach memory.
  static void fence() {
    if (running != nullptr) flush(running->buffers_[running->current_]);
  }
  /// Those of all do.
  static void fence_all() {
    for (std::deque<Delayed>& buffer : running->buffers_) flush(buffer);
  }

 private:
  struct Choice {
    std::size_t taken, options;
  };
  struct Delayed {
    void* where;
    std::uint64_t value;
    std::size_t size;
  };
  static constexpr std::size_t kStackBytes = 128 * 1024;
  static constexpr std::size_t kMaxBodies = 4;
  static constexpr int kMaxSteps = 100'000;

  void run(int preemptions, int delays) {
    steps = 0;
    preemptions_left_ = preemptions;
    delays_left_ = delays;
    position_ = 0;
    blocked_ = 0;
    waiting_.clear();
    runnable_.clear();
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      runnable_.push_back(i);
      ucontext_t& context = contexts_.at(i);
      getcontext(&context);
      context.uc_stack.ss_sp = stacks_[i].get();
      context.uc_stack.ss_size = kStackBytes;
      context.uc_link = nullptr;
      makecontext(&context, &Explorer::enter, 0);
    }
    running = this;
    while (!runnable_.empty()) {
      current_ = runnable_[choose(runnable_.size())];
      swapcontext(&main_, &contexts_[current_]);
    }
    running = nullptr;
  }

  static void enter() {
    Explorer& self = *running;
    self.bodies_[self.current_]();
    fence();
    std::erase(self.runnable_, self.current_);
    setcontext(&self.main_);
  }

  void may_switch() {
    if (preemptions_left_ == 0) return;
    const std::size_t choice = choose(runnable_.size());
    if (choice == 0) return;
    --preemptions_left_;
    // The others, in order, without the one that runs.
    std::size_t next = choice - 1;
    const auto self = std::find(runnable_.begin(), runnable_.end(), current_);
    if (next >= static_cast<std::size_t>(self - runnable_.begin())) ++next;
    const std::size_t preempted = std::exchange(current_, runnable_[next]);
    swapcontext(&contexts_[preempted], &contexts_[current_]);
  }

  /// Stores of other contexts to this variable, or to any, may reach memory now, each after those
  /// before it.
  void may_write(const void* where) {
    for (std::size_t context = 0; context < bodies_.size(); ++context) {
      if (context == current_) continue;
      std::deque<Delayed>& buffer = buffers_[context];
      for (auto store = find(buffer, where); store != buffer.end() && choose(2) == 1;
           store = find(buffer, where)) {
        for (auto more = store - buffer.begin(); more >= 0; --more) write_first(buffer);
      }
    }
  }
  /// The first store that waits there to this variable, or to any.
  static std::deque<Delayed>::const_iterator find(const std::deque<Delayed>& buffer,
                                                  const void* where) {
    return std::find_if(buffer.begin(), buffer.end(), [where](const Delayed& entry) {
      return where == nullptr || entry.where == where;
    });
  }
  [[noreturn]] static void fail(const char* why) {
    std::fprintf(stderr, "%s\n", why);
    std::abort();
  }
  static void write_first(std::deque<Delayed>& buffer) {
    std::memcpy(buffer.front().where, &buffer.front().value, buffer.front().size);
    buffer.pop_front();
  }
  static void flush(std::deque<Delayed>& buffer) {
    while (!buffer.empty()) write_first(buffer);
  }

  std::size_t choose(std::size_t options) {
    if (options == 1) return 0;
    if (position_ == choices_.size()) choices_.push_back({0, options});
    return choices_[position_++].taken;
  }

  bool next_schedule() {
    while (!choices_.empty() && choices_.back().taken + 1 == choices_.back().options) {
      choices_.pop_back();
    }
    if (choices_.empty()) return false;
    ++choices_.back().taken;
    return true;
  }

  static inline Explorer* running = nullptr;
  static inline int steps = 0;  // of this run

  Bodies bodies_;
  std::vector<std::size_t> runnable_;
  std::size_t blocked_ = 0;
  std::vector<std::pair<const void*, std::size_t>> waiting_;  // contexts, each at a variable
  std::vector<Choice> choices_;
  std::size_t position_ = 0;
  std::size_t current_ = 0;
  int preemptions_left_ = 0, delays_left_ = 0;
  std::array<std::deque<Delayed>, kMaxBodies> buffers_;
  ucontext_t main_;
  std::array<ucontext_t, kMaxBodies> contexts_;
  std::array<std::unique_ptr<char[]>, kMaxBodies> stacks_{
      std::make_unique<char[]>(kStackBytes), std::make_unique<char[]>(kStackBytes),
      std::make_unique<char[]>(kStackBytes), std::make_unique<char[]>(kStackBytes)};
};

// What the files under test find when they say std.
namespace std {
using namespace ::std;  // NOLINT(google-build-using-namespace)

template <class T>
class atomic {
 public:
  atomic(T value = T()) : value_(value) {}  // NOLINT(google-explicit-constructor)
  atomic& operator=(T value) {
    store(value);
    return *this;
  }
  T load(memory_order = memory_order_seq_cst) const {
    Explorer::point(&value_);
    T value = value_;
    if (const ::std::uint64_t* own = Explorer::delayed(&value_)) memcpy(&value, own, sizeof value);
    return value;
  }
  void store(T value, memory_order order = memory_order_seq_cst) {
    Explorer::point(&value_);
    if (order != memory_order_seq_cst) {
      ::std::uint64_t bits = 0;
      static_assert(sizeof value <= sizeof bits);
      memcpy(&bits, &value, sizeof value);
      if (Explorer::delay(&value_, bits, sizeof value)) return;
    }
    Explorer::fence();
    value_ = value;
  }
  T exchange(T value, memory_order = memory_order_seq_cst) {
    change();
    return ::std::exchange(value_, value);
  }
  T fetch_add(T value, memory_order = memory_order_seq_cst) {
    change();
    return ::std::exchange(value_, value_ + value);
  }
  T fetch_sub(T value, memory_order = memory_order_seq_cst) {
    change();
    return ::std::exchange(value_, value_ - value);
  }
  T fetch_or(T value, memory_order = memory_order_seq_cst) {
    change();
    return ::std::exchange(value_, value_ | value);
  }
  bool compare_exchange_strong(T& expected, T value, memory_order = memory_order_seq_cst,
                               memory_order = memory_order_seq_cst) {
    change();
    const bool equal = value_ == expected;
    (equal ? value_ : expected) = equal ? value : value_;
    return equal;
  }
  bool compare_exchange_weak(T& expected, T value, memory_order = memory_order_seq_cst,
                             memory_order = memory_order_seq_cst) {
    return compare_exchange_strong(expected, value);
  }
  void wait(T old, memory_order = memory_order_seq_cst) const {
    while (load() == old) Explorer::wait_at(&value_);
  }
  void notify_all() {
    Explorer::point(&value_);
    Explorer::wake_all_at(&value_);
  }
  /// As a model of the kernel accesses it, within one step.
  T peek() const { return value_; }
  void poke(T value) { value_ = value; }

 private:
  void change() {
    Explorer::point(&value_);
    Explorer::fence();
  }
  T value_;
};

}  // namespace std
}  // namespace takt_explored

#endif  // TAKT_TESTING_EXPLORER_HPP_
