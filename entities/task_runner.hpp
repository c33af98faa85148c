// Resumes the coroutines of one callback.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_TASK_RUNNER_HPP_
#define TAKT_ENTITIES_TASK_RUNNER_HPP_

#include <atomic>
#include <concepts>
#include <coroutine>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/entities/task.hpp"
#include "takt/entities/timer.hpp"

namespace TAKT_PUBLIC takt {

/// Has a runner, and waits for one of its tasks to end.
/// Thread safety and real-time: task_ended on any thread; it neither blocks nor allocates.
class TaskOwner {
 public:
  /// Another task may be started. Inside a read section.
  virtual void task_ended() noexcept = 0;

 protected:
  ~TaskOwner() = default;
};

/// The entity by which coroutines go on, in the callback group of the callback that has begun
/// them. There is one for each such callback.
///
/// The protocol:
/// 1. A thread that starts a task reserves a place for it, and so decides whether anything is
/// taken.
/// 2. The task runs, on the caller's thread, until it waits. A Waiting in its frame is then in the
///    list of what it waits for, which holds a lock while it hands the Waiting to the runner.
/// 3. The runner announces itself. Its executor takes the oldest Waiting and resumes the task.
/// 4. When the callback's entity retires, so does the runner: no task runs any more, and those that
///    wait are destroyed. They take themselves out of the lists that they are in. Retiring inside
///    one of its tasks takes effect when that waits, or ends.
///
/// Thread safety: every method from any thread.
/// Real-time: locks with priority inheritance, held for steps that are bounded by the number of
/// tasks; nothing allocates. start and execute run the user's code.
class TaskRunner : public Entity {
 public:
  /// `most_tasks`: started and not ended.
  TaskRunner(const std::string& callback, std::shared_ptr<CallbackGroup> group, Clock& clock,
             std::size_t most_tasks);
  ~TaskRunner() override;

  Clock& clock() const noexcept { return clock_; }
  void set_owner_of_tasks(TaskOwner& owner) noexcept { task_owner_ = &owner; }
  /// The timer that wakes sleeping tasks; it is the runner's from then on.
  void set_alarm(std::shared_ptr<Timer> alarm);

  bool is_free() const noexcept { return reserved_.load() < tasks_.size(); }
  /// False: as many as may be are there.
  bool reserve() noexcept;
  void give_back() noexcept;
  /// Begins the task that `make` returns, for which a place is reserved. Throws what they throw.
  template <std::invocable Make>
  void start(Make&& make) {
    begin([&] {
      try {
        return run(make());
      } catch (...) {
        give_back();
        throw;
      }
    }());
  }

  /// The event that it has waited for has happened.
  void resume_later(Waiting& waiting) noexcept;
  /// `time` is on the clock's timeline.
  void resume_at(Waiting& waiting, TimePoint time) noexcept;
  /// It does not wait any more, for its frame is being destroyed.
  void forget(const Waiting& waiting) noexcept;
  /// For the alarm: tasks that have slept long enough continue.
  void wake_sleepers() noexcept;
  void announce_if_ready() noexcept;

  std::size_t ready_count() const noexcept override { return ready_count_.load(); }
  bool front(Arrival& arrival) const noexcept override;
  bool take(Slot& slot) noexcept override;
  void execute(Slot& slot) override;
  void discard(Slot& slot) noexcept override;
  void retire() noexcept override;
  void retired(std::shared_ptr<Entity> self) noexcept override { keep(std::move(self)); }
  /// After retiring: the callback's entity, or the runner itself, lives as long as one of its tasks
  /// runs.
  void keep(std::shared_ptr<Entity> owner) noexcept;

 private:
  /// The outermost coroutine of a task. At its end it destroys itself, and with it all of the task.
  struct Root {
    struct promise_type;
    std::coroutine_handle<promise_type> coroutine;
  };
  static Root run(Task<> task);
  void begin(Root root);
  void go_on(std::coroutine_handle<> coroutine);
  void ended(std::size_t place) noexcept;
  void leave() noexcept;
  void set_alarm_clock() noexcept;

  // The exception of the task that this thread resumes.
  static thread_local constinit std::exception_ptr* failure_;

  Clock& clock_;
  std::shared_ptr<Timer> alarm_;
  std::atomic<std::size_t> reserved_{0}, ready_count_{0};

  mutable RankedMutex<LockRank::tasks> mutex_;  // guards all below
  TaskOwner* task_owner_ = nullptr;
  std::vector<std::coroutine_handle<>> tasks_;  // by place; nullptr: none
  WaitingList ready_;
  struct Sleeper {
    TimePoint until;
    Waiting* waiting;
  };
  std::vector<Sleeper> sleepers_;  // with room for all
  std::size_t running_ = 0;        // threads that are in a task
  bool is_retired_ = false;
  std::shared_ptr<Entity> kept_;
};

/// Waits in a task, on its clock.
/// Thread safety: belongs to its task.
/// Real-time: as TaskRunner.
class Sleep {
 public:
  Sleep(Nanoseconds duration, TimePoint until) noexcept : duration_(duration), until_(until) {}
  ~Sleep() {
    if (waiting_.runner != nullptr) waiting_.runner->forget(waiting_);
  }
  Sleep(const Sleep&) = delete;
  Sleep& operator=(const Sleep&) = delete;

  bool await_ready() const noexcept { return false; }
  template <class Promise>
  void await_suspend(std::coroutine_handle<Promise> coroutine) noexcept {
    waiting_.suspend(coroutine);
    TaskRunner& runner = *waiting_.runner;
    Clock& clock = runner.clock();
    runner.resume_at(waiting_, until_ == TimePoint{} ? later(clock.timeline().now(), duration_)
                                                     : clock.on_timeline(until_));
  }
  void await_resume() const noexcept {}

 private:
  const Nanoseconds duration_;
  const TimePoint until_;
  Waiting waiting_;
};

inline Sleep sleep_for(Nanoseconds duration) noexcept {
  return Sleep(duration, {});
}
inline Sleep sleep_until(TimePoint time) noexcept {
  return Sleep({}, time);
}

/// Ends a batch of long work, see batch().
/// Thread safety: belongs to its task.
/// Real-time: as TaskRunner.
class Batch {
 public:
  Batch() = default;
  ~Batch() {
    if (waiting_.runner != nullptr) waiting_.runner->forget(waiting_);
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  bool await_ready() const noexcept { return false; }
  template <class Promise>
  void await_suspend(std::coroutine_handle<Promise> coroutine) noexcept {
    waiting_.suspend(coroutine);
    waiting_.runner->resume_later(waiting_);
  }
  void await_resume() const noexcept {}

 private:
  Waiting waiting_;
};

/// Divides long work: `co_await batch()` gives the thread back. What is ready runs, of the task's
/// own group too, as the scheduler orders it, and the task goes on as "NAME/resumed", which is
/// ready from now on. So each batch is an execution of its own: it is counted as one, and `budget`
/// and `deadline` are about it.
///
/// A cancel is seen between two batches: what asks for it is a callback as well. So look at the
/// goal's is_canceling(), or a std::stop_token, behind each. Where another thread may set it, in an
/// executor of several or by a more urgent callback of `preemptive`, a batch that looks again and
/// again ends at once. A task whose callback is dropped does not go on.
inline Batch batch() noexcept {
  return {};
}

/// A timer whose callback is a coroutine.
/// Thread safety and real-time: as Timer and TaskRunner.
class TaskTimer : public Timer {
 public:
  TaskTimer(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
            Nanoseconds period, std::function<Task<>()> callback,
            std::shared_ptr<TaskRunner> runner)
      : Timer(std::move(name), std::move(group), clock, period, [] {}),
        callback_(std::move(callback)),
        runner_(std::move(runner)) {}

  void execute(Slot&) override {
    if (runner_->reserve()) {
      runner_->start(callback_);
    } else {
      miss();
    }
  }
  void retire() noexcept override {
    Timer::retire();
    runner_->retire();
  }
  void retired(std::shared_ptr<Entity> self) noexcept override { runner_->keep(std::move(self)); }

 private:
  const std::function<Task<>()> callback_;
  const std::shared_ptr<TaskRunner> runner_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_TASK_RUNNER_HPP_
