// Coroutines as callbacks: they wait without blocking their thread.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_TASK_HPP_
#define TAKT_ENTITIES_TASK_HPP_

#include <atomic>
#include <concepts>
#include <coroutine>
#include <cstddef>
#include <exception>
#include <optional>
#include <type_traits>
#include <utility>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/transport/message_block.hpp"

namespace TAKT_PUBLIC takt {

class TaskRunner;

/// Where the frames of coroutines lie: lists of blocks of 256 bytes, 512, and so on to 8 KiB. A
/// block that comes back is kept for the next frame, so only a new peak allocates.
/// Thread safety: every function from any thread.
/// Real-time: a lock with priority inheritance, held for a few instructions. Frames above 8 KiB
/// come from the heap.
class FrameMemory {
 public:
  static void* allocate(std::size_t bytes);
  static void free(void* frame, std::size_t bytes) noexcept;
  /// From now on `count` more frames of up to 2 KiB fit without an allocation.
  static void prepare(std::size_t count);
};

/// The base of the promises of our coroutines.
struct TaskContext {
  TaskRunner* runner = nullptr;  // that resumes it

  static void* operator new(std::size_t bytes) { return FrameMemory::allocate(bytes); }
  static void operator delete(void* frame, std::size_t bytes) noexcept {
    FrameMemory::free(frame, bytes);
  }
};

/// The return type of a coroutine that may `co_await`: a callback returns Task<>, a function that
/// is awaited by one Task<T>. It begins when it is awaited, and throws there what it throws.
///
/// What it awaits: another Task; sleep_for and sleep_until; batch(), between parts of long work;
/// Client::call; Receiver::receive; an ActionClient's calls. Until that is there it is outside its
/// callback group, whose other callbacks run meanwhile; then it goes on inside it, as a callback of
/// its own: "NAME/resumed".
///
/// A callback that is a coroutine is not called again before it has ended: messages and requests
/// wait in their queues, a timer's releases are counted as missed. When its entity is dropped, the
/// coroutine is destroyed where it waits.
///
/// Take parameters as the callback gets them: they live until it has ended. The captures of a
/// lambda live as long as its entity; what it refers to must too.
/// Thread safety: as any value, until it is awaited.
/// Real-time: as FrameMemory.
template <class T = void>
class [[nodiscard]] Task;

// ---- Behind Task ----

struct TaskPromiseBase : TaskContext {
  std::coroutine_handle<> continuation;
  std::exception_ptr failure;
  // The task ends, or the one that awaits it begins to wait: the second one sees that the first one
  // has come, and goes on with the one that awaits. If the task has ended at once, that has not
  // even waited, so a loop of such tasks needs no more stack than one of them.
  std::atomic<bool> has_met{false};

  struct Continue {
    bool await_ready() const noexcept { return false; }
    template <class Promise>
    std::coroutine_handle<> await_suspend(std::coroutine_handle<Promise> ended) const noexcept {
      TaskPromiseBase& promise = ended.promise();
      if (promise.has_met.exchange(true)) return promise.continuation;
      return std::noop_coroutine();
    }
    void await_resume() const noexcept {}
  };
  std::suspend_always initial_suspend() const noexcept { return {}; }
  Continue final_suspend() const noexcept { return {}; }
  void unhandled_exception() noexcept { failure = std::current_exception(); }
};

template <class T>
struct TaskPromise : TaskPromiseBase {
  std::optional<T> value;

  Task<T> get_return_object() noexcept;
  template <class U>
  void return_value(U&& returned) {
    value.emplace(std::forward<U>(returned));
  }
  T result() {
    if (failure) std::rethrow_exception(failure);
    return std::move(*value);
  }
};
template <>
struct TaskPromise<void> : TaskPromiseBase {
  Task<void> get_return_object() noexcept;
  void return_void() const noexcept {}
  void result() const {
    if (failure) std::rethrow_exception(failure);
  }
};

/// Thread safety and real-time: as declared above.
template <class T>
class [[nodiscard]] Task {
 public:
  using promise_type = TaskPromise<T>;

  explicit Task(std::coroutine_handle<promise_type> coroutine) noexcept : coroutine_(coroutine) {}
  Task(Task&& other) noexcept : coroutine_(std::exchange(other.coroutine_, nullptr)) {}
  Task& operator=(Task&& other) noexcept {
    std::swap(coroutine_, other.coroutine_);
    return *this;
  }
  ~Task() {
    if (coroutine_) coroutine_.destroy();
  }

  class Awaiter {
   public:
    explicit Awaiter(std::coroutine_handle<promise_type> coroutine) noexcept
        : coroutine_(coroutine) {}
    bool await_ready() const noexcept { return false; }
    // Not inline, as a compiler may keep local variables of the inlined one in the frame, which
    // another thread may free when both have met.
    template <class Promise>
    [[gnu::noinline]] bool await_suspend(std::coroutine_handle<Promise> awaiting) noexcept {
      promise_type& promise = coroutine_.promise();
      promise.continuation = awaiting;
      promise.runner = awaiting.promise().runner;
      coroutine_.resume();
      return !promise.has_met.exchange(true);
    }
    T await_resume() { return coroutine_.promise().result(); }

   private:
    std::coroutine_handle<promise_type> coroutine_;
  };
  Awaiter operator co_await() && noexcept { return Awaiter(coroutine_); }

 private:
  std::coroutine_handle<promise_type> coroutine_;
};

template <class T>
Task<T> TaskPromise<T>::get_return_object() noexcept {
  return Task<T>(std::coroutine_handle<TaskPromise>::from_promise(*this));
}
inline Task<void> TaskPromise<void>::get_return_object() noexcept {
  return Task<void>(std::coroutine_handle<TaskPromise>::from_promise(*this));
}

/// A callback that is a coroutine.
template <class F, class... Arguments>
concept TaskCallback = std::invocable<F&, Arguments...> &&
    std::same_as<std::invoke_result_t<F&, Arguments...>, Task<>>;

/// Where a coroutine waits. It lies in the frame, and is in one list at a time: that of what it
/// waits for, or its runner's.
struct Waiting {
  TaskRunner* runner = nullptr;
  std::coroutine_handle<> coroutine;
  Waiting* next = nullptr;
  Arrival arrival{};  // when it became ready to go on
  // The chain instance that it belongs to, and its path so far.
  std::uint64_t chain_instance = 0;
  TimePoint root_release{};
  std::uint64_t path = 0;

  Waiting() = default;
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  /// Before it is put into a list: from then on it may be resumed, by any thread.
  template <class Promise>
  void suspend(std::coroutine_handle<Promise> where) noexcept {
    runner = where.promise().runner;
    coroutine = where;
    remember_chain();
  }

 private:
  void remember_chain() noexcept;
};

/// First in, first out.
/// Thread safety: none; the owner's lock guards it.
/// Real-time: nothing blocks or allocates; remove is linear.
class WaitingList {
 public:
  bool empty() const noexcept { return first_ == nullptr; }
  Waiting* front() const noexcept { return first_; }
  void push(Waiting& waiting) noexcept {
    waiting.next = nullptr;
    *end_ = &waiting;
    end_ = &waiting.next;
  }
  Waiting* pop() noexcept {
    Waiting* first = first_;
    if (first != nullptr) unlink(first_);
    return first;
  }
  /// False when it is not in the list.
  bool remove(const Waiting& waiting) noexcept {
    for (Waiting** link = &first_; *link != nullptr; link = &(*link)->next) {
      if (*link != &waiting) continue;
      unlink(*link);
      return true;
    }
    return false;
  }

 private:
  void unlink(Waiting*& link) noexcept {
    if (end_ == &link->next) end_ = &link;
    link = link->next;
  }
  Waiting* first_ = nullptr;
  Waiting** end_ = &first_;
};

/// A message that was awaited, until the object goes. False: there is none.
/// Thread safety: as any value.
/// Real-time: nothing blocks or allocates.
template <class T>
class TakenMessage {
 public:
  TakenMessage() = default;
  TakenMessage(MessageBlock* block, const T* message) noexcept : block_(block), message_(message) {}
  TakenMessage(TakenMessage&& other) noexcept
      : block_(std::exchange(other.block_, nullptr)), message_(other.message_) {}
  TakenMessage& operator=(TakenMessage&& other) noexcept {
    std::swap(block_, other.block_);
    std::swap(message_, other.message_);
    return *this;
  }
  ~TakenMessage() {
    if (block_ != nullptr) block_->release();
  }

  explicit operator bool() const noexcept { return block_ != nullptr; }
  const T& operator*() const noexcept { return *message_; }
  const T* operator->() const noexcept { return message_; }

 private:
  MessageBlock* block_ = nullptr;
  const T* message_ = nullptr;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_TASK_HPP_
