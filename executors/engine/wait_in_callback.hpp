// Waiting, inside a callback, for the end of another one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_WAIT_IN_CALLBACK_HPP_
#define TAKT_EXECUTORS_ENGINE_WAIT_IN_CALLBACK_HPP_

#include <atomic>
#include <cstdint>

#include "takt/entities/entity.hpp"

namespace takt::detail {

struct CallbackRecord;

/// The calling thread waits, for as long as the object lives, until a callback that is removed has
/// returned. All such waits of the process are known. If callbacks wait for each other, in a cycle
/// of any length, the one that would close the cycle detects that and does not wait.
///
/// Thread safety: an object belongs to the thread that made it.
class WaitInCallback {
 public:
  explicit WaitInCallback(const CallbackRecord& until) noexcept;
  ~WaitInCallback();
  WaitInCallback(const WaitInCallback&) = delete;
  WaitInCallback& operator=(const WaitInCallback&) = delete;

  /// The callback cannot return before one that the calling thread is in.
  bool is_for_itself() const noexcept { return is_for_itself_; }

  /// An update was published or installed, or a callback is gone: all waiting threads look again.
  static void notify_progress() noexcept {
    progress_.fetch_add(1);
    progress_.notify_all();
  }
  static std::uint32_t progress() noexcept { return progress_.load(); }
  static void wait_for_progress(std::uint32_t seen) noexcept { progress_.wait(seen); }

 private:
  static bool closes_cycle(const CallbackRecord& record) noexcept;

  const CallbackRecord& until_;
  const Dispatch* const inside_;  // innermost; it does not change while we wait
  bool is_for_itself_ = false;
  WaitInCallback* next_ = nullptr;
  static constinit WaitInCallback* first_;  // guarded by a mutex
  static constinit std::atomic<std::uint32_t> progress_;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_WAIT_IN_CALLBACK_HPP_
