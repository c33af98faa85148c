// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/task_runner.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <mutex>
#include <new>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/never_destroyed.hpp"

namespace takt {
namespace {

// ---- Frames ----

constexpr std::size_t kSmallest = 256, kSizes = 6;  // up to 8 KiB

struct FreeFrame {
  FreeFrame* next;
};
struct FrameList {
  PiMutex mutex;
  FreeFrame* first = nullptr;
};

FrameList& frames(std::size_t size) {
  static detail::NeverDestroyed<std::array<FrameList, kSizes>> lists;
  return (*lists)[size];
}

// The free list for frames of this size; kSizes: none, the frame is too large.
std::size_t size_of(std::size_t bytes) noexcept {
  const std::size_t units = (std::max<std::size_t>(bytes, 1) - 1) / kSmallest;
  return std::min<std::size_t>(std::bit_width(units), kSizes);
}

void put(FrameList& list, void* memory) noexcept {
  auto* frame = ::new (memory) FreeFrame;
  const std::lock_guard lock(list.mutex);
  frame->next = list.first;
  list.first = frame;
}

}  // namespace

void* FrameMemory::allocate(std::size_t bytes) {
  const std::size_t size = size_of(bytes);
  if (size == kSizes) return ::operator new(bytes);
  {
    FrameList& list = frames(size);
    const std::lock_guard lock(list.mutex);
    if (FreeFrame* frame = list.first; frame != nullptr) {
      list.first = frame->next;
      return frame;
    }
  }
  return ::operator new(kSmallest << size);
}

void FrameMemory::free(void* frame, std::size_t bytes) noexcept {
  const std::size_t size = size_of(bytes);
  if (size == kSizes) {
    ::operator delete(frame);
  } else {
    put(frames(size), frame);
  }
}

void FrameMemory::prepare(std::size_t count) {
  for (std::size_t size = 0; (kSmallest << size) <= 2048; ++size) {
    for (std::size_t i = 0; i < count; ++i) put(frames(size), ::operator new(kSmallest << size));
  }
}

// ---- Tasks ----

void Waiting::remember_chain() noexcept {
  const Dispatch* dispatch = Dispatch::current();
  if (dispatch == nullptr) return;
  chain_instance = dispatch->chain_instance;
  root_release = dispatch->root_release;
  path = dispatch->path;
}

struct TaskRunner::Root::promise_type : TaskContext {
  std::size_t place = 0;

  struct End {
    bool await_ready() const noexcept { return false; }
    void await_suspend(std::coroutine_handle<promise_type> root) const noexcept {
      TaskRunner& runner = *root.promise().runner;
      const std::size_t ended = root.promise().place;
      root.destroy();
      runner.ended(ended);
    }
    void await_resume() const noexcept {}
  };
  Root get_return_object() noexcept {
    return {std::coroutine_handle<promise_type>::from_promise(*this)};
  }
  std::suspend_always initial_suspend() const noexcept { return {}; }
  End final_suspend() const noexcept { return {}; }
  void return_void() const noexcept {}
  void unhandled_exception() const noexcept { *failure_ = std::current_exception(); }
};

TaskRunner::Root TaskRunner::run(Task<> task) {
  co_await std::move(task);
}

thread_local constinit std::exception_ptr* TaskRunner::failure_ = nullptr;

TaskRunner::TaskRunner(const std::string& callback, std::shared_ptr<CallbackGroup> group,
                       Clock& clock, std::size_t most_tasks)
    : Entity(EntityKind::waitable, callback + "/resumed", std::move(group)),
      clock_(clock),
      tasks_(most_tasks) {
  sleepers_.reserve(most_tasks);
  FrameMemory::prepare(3 * most_tasks);  // the root, the callback, and a task that it awaits
}

TaskRunner::~TaskRunner() {
  for (const auto task : tasks_) {
    if (task) task.destroy();
  }
}

void TaskRunner::set_alarm(std::shared_ptr<Timer> alarm) {
  alarm_ = std::move(alarm);
}

bool TaskRunner::reserve() noexcept {
  std::size_t reserved = reserved_.load();
  while (reserved < tasks_.size()) {
    if (reserved_.compare_exchange_weak(reserved, reserved + 1)) return true;
  }
  return false;
}

void TaskRunner::give_back() noexcept {
  const ReadSection section;
  const std::lock_guard lock(mutex_);
  reserved_.fetch_sub(1);
  if (task_owner_ != nullptr && !is_retired_) task_owner_->task_ended();
}

void TaskRunner::begin(Root root) {
  {
    const std::lock_guard lock(mutex_);
    const auto place = std::find(tasks_.begin(), tasks_.end(), nullptr);
    *place = root.coroutine;
    root.coroutine.promise().runner = this;
    root.coroutine.promise().place = static_cast<std::size_t>(place - tasks_.begin());
  }
  go_on(root.coroutine);
}

// After resume(), the coroutine may be destroyed, or on another thread.
void TaskRunner::go_on(std::coroutine_handle<> coroutine) {
  std::exception_ptr failure;
  {
    const std::lock_guard lock(mutex_);
    ++running_;
  }
  std::exception_ptr* outer = std::exchange(failure_, &failure);
  coroutine.resume();
  failure_ = outer;
  leave();
  if (failure) std::rethrow_exception(failure);
}

void TaskRunner::leave() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (--running_ != 0 || !is_retired_) return;
  }
  // No other thread uses the tasks of a retired runner.
  for (auto& task : tasks_) {
    if (task) std::exchange(task, nullptr).destroy();
  }
  keep(nullptr);
}

// The old pointer is destroyed after the unlock: it may be the last one to this runner.
void TaskRunner::keep(std::shared_ptr<Entity> owner) noexcept {
  const std::lock_guard lock(mutex_);
  if (owner == nullptr || running_ != 0) kept_.swap(owner);
}

void TaskRunner::ended(std::size_t place) noexcept {
  {
    const std::lock_guard lock(mutex_);
    tasks_[place] = nullptr;
  }
  give_back();
}

void TaskRunner::resume_later(Waiting& waiting) noexcept {
  const ReadSection section;
  const Arrival arrival{next_sequence(), clock_.real().now()};
  {
    const std::lock_guard lock(mutex_);
    waiting.arrival = arrival;
    ready_.push(waiting);
    ready_count_.fetch_add(1);
  }
  announce(arrival);  // not waiting.arrival: `waiting` may be gone
}

void TaskRunner::resume_at(Waiting& waiting, TimePoint time) noexcept {
  const std::lock_guard lock(mutex_);
  sleepers_.push_back({time, &waiting});
  set_alarm_clock();
}

// With the mutex held: of two threads that do this, the later one sees all sleepers.
void TaskRunner::set_alarm_clock() noexcept {
  TimePoint first = kNever;
  for (const Sleeper& sleeper : sleepers_) first = std::min(first, sleeper.until);
  if (alarm_->due() != first) alarm_->release_at(first);
}

void TaskRunner::wake_sleepers() noexcept {
  for (;;) {
    Waiting* awake = nullptr;
    {
      const std::lock_guard lock(mutex_);
      const auto first =
          std::min_element(sleepers_.begin(), sleepers_.end(),
                           [](const Sleeper& a, const Sleeper& b) { return a.until < b.until; });
      if (first != sleepers_.end() && first->until <= clock_.timeline().now()) {
        awake = first->waiting;
        sleepers_.erase(first);
      } else {
        set_alarm_clock();
      }
    }
    if (awake == nullptr) return;
    resume_later(*awake);
  }
}

void TaskRunner::forget(const Waiting& waiting) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase_if(sleepers_, [&](const Sleeper& sleeper) { return sleeper.waiting == &waiting; });
  if (ready_.remove(waiting)) ready_count_.fetch_sub(1);
}

void TaskRunner::announce_if_ready() noexcept {
  Arrival arrival{};
  const ReadSection section;
  if (ready_count() != 0 && front(arrival)) announce(arrival);
}

bool TaskRunner::front(Arrival& arrival) const noexcept {
  const std::lock_guard lock(mutex_);
  if (ready_.empty()) return false;
  arrival = ready_.front()->arrival;
  return true;
}

bool TaskRunner::take(Slot& slot) noexcept {
  const std::lock_guard lock(mutex_);
  Waiting* waiting = ready_.pop();
  if (waiting == nullptr) return false;
  slot.more = ready_count_.fetch_sub(1) > 1;
  slot.waiting = waiting;
  slot.sequence = waiting->arrival.sequence;
  slot.ready_time = waiting->arrival.ready_time;
  slot.chain_instance = waiting->chain_instance;
  slot.root_release = waiting->root_release;
  slot.path = retract_path(waiting->path, mark());  // still counts as the callback that began it
  return true;
}

void TaskRunner::execute(Slot& slot) {
  go_on(slot.waiting->coroutine);
}

// The coroutine is ready again.
void TaskRunner::discard(Slot& slot) noexcept {
  const std::lock_guard lock(mutex_);
  ready_.push(*slot.waiting);
  ready_count_.fetch_add(1);
}

void TaskRunner::retire() noexcept {
  Entity::retire();
  if (alarm_ != nullptr) alarm_->retire();
  {
    const std::lock_guard lock(mutex_);
    is_retired_ = true;
    ++running_;
  }
  leave();
}

}  // namespace takt
