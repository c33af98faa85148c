// Waiting, inside a callback, for the end of another one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_WAIT_IN_CALLBACK_HPP_
#define TAKT_ENTITIES_WAIT_IN_CALLBACK_HPP_

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <utility>

#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// The calling thread runs code, for as long as the object lives, which others may wait for by this
/// name: of the user, such as a function of a callback list, or our own.
/// Thread safety: an object belongs to the thread that made it. Real-time: yes.
class Running {
 public:
  enum class Code { of_user, own };
  explicit Running(const void* what, Code code = Code::of_user) noexcept
      : what_(what), code_(code), outer_(std::exchange(innermost_, this)) {}
  ~Running() { innermost_ = outer_; }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  /// nullptr: the calling thread runs none.
  static const Running* innermost() noexcept { return innermost_; }
  static bool is_code_of_user() noexcept {
    for (const Running* each = innermost_; each != nullptr; each = each->outer_) {
      if (each->code_ == Code::of_user) return true;
    }
    return false;
  }
  /// How often the calling thread is in it.
  static std::uint32_t depth_of(const void* what) noexcept {
    std::uint32_t depth = 0;
    for (const Running* each = innermost_; each != nullptr; each = each->outer_) {
      if (each->what_ == what) ++depth;
    }
    return depth;
  }

 private:
  friend class WaitInCallback;
  const void* const what_;
  const Code code_;
  const Running* const outer_;
  static thread_local constinit const Running* innermost_;
};

/// The calling thread waits, for as long as the object lives, until a callback that is removed has
/// returned, or what Running describes is over. All such waits of the process are known. If threads
/// wait for each other, in a cycle of any length, the one that would close the cycle detects that
/// and does not wait.
///
/// Thread safety: an object belongs to the thread that made it.
class WaitInCallback {
 public:
  /// Whether the calling thread runs code of the user that others may wait for.
  static bool may_be_awaited() noexcept {
    return Dispatch::current() != nullptr || Running::is_code_of_user();
  }

  enum class Whose { all, of_others };
  /// For the end of a Running; `of_others`: the calling thread may be in it itself.
  explicit WaitInCallback(const void* running, Whose whose = Whose::all) noexcept
      : WaitInCallback(Awaited{running, nullptr}, whose) {}
  /// For that of a callback: `describes` says whether this is what an executor's thread runs.
  using Describes = bool (*)(const void* record, const CallbackInfo* callback);
  WaitInCallback(const void* record, Describes describes) noexcept
      : WaitInCallback(Awaited{record, describes}, Whose::all) {}
  ~WaitInCallback();
  WaitInCallback(const WaitInCallback&) = delete;
  WaitInCallback& operator=(const WaitInCallback&) = delete;

  /// A thread that waits is in this Running.
  static bool is_anyone_waiting_in(const void* running) noexcept;

  /// It cannot end before something that the calling thread is in.
  bool is_for_itself() const noexcept { return is_for_itself_; }
  /// Waits until this is true, which the caller of notify_progress has changed. Meanwhile the
  /// thread does what others may wait for, see set_duty. False: it was not for so long; then it
  /// looks again and again, as no other wait has an end.
  template <class Condition>
  bool until(Condition&& is_true, Nanoseconds at_most = Nanoseconds::max()) const noexcept {
    constexpr Nanoseconds kLongest = std::chrono::milliseconds(1);
    Nanoseconds pause = std::chrono::microseconds(20);
    for (Nanoseconds waited{0};; waited += pause, pause = std::min(2 * pause, kLongest)) {
      const std::uint32_t seen = progress_.load();
      if (const Duty duty = duty_.load()) duty();
      if (is_true()) return true;
      if (waited >= at_most) return false;
      at_most == Nanoseconds::max() ? progress_.wait(seen) : std::this_thread::sleep_for(pause);
    }
  }

  /// Something that is waited for is over, or nearer to it: all waiting threads look again.
  static void notify_progress() noexcept {
    progress_.fetch_add(1);
    progress_.notify_all();
  }
  /// What only the calling thread may be able to do: of executors, to install an update.
  using Duty = void (*)() noexcept;
  static void set_duty(Duty duty) noexcept { duty_.store(duty); }

 private:
  struct Awaited {
    const void* what;
    Describes describes;  // nullptr: it is a Running
    bool operator==(const Awaited&) const = default;
  };
  /// What a thread is in.
  struct Inside {
    const Dispatch* dispatch;
    const Running* running;
    bool has(const Awaited& awaited) const noexcept;
  };
  WaitInCallback(const Awaited& until, Whose whose) noexcept;
  static bool closes_cycle(const Inside& own, const Awaited& until) noexcept;
  static bool others_wait_for(const Inside& own, const Awaited& until) noexcept;

  const Awaited until_;
  const Inside inside_;  // innermost; it does not change while we wait
  bool is_for_itself_ = false;
  WaitInCallback* next_ = nullptr;
  static constinit WaitInCallback* first_;  // guarded by a mutex
  static constinit std::atomic<std::uint32_t> progress_;
  static constinit std::atomic<Duty> duty_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_ENTITIES_WAIT_IN_CALLBACK_HPP_
