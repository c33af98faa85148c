// The modes of a container: which is wanted, which is in force, and what has switched.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODES_HPP_
#define TAKT_CONTAINERS_MODES_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/callback_groups/callback_parameters.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/result.hpp"
#include "takt/entities/guard_condition.hpp"

namespace TAKT_INTERNAL takt {

/// How a mode is switched:
/// 1. An overrun, a component or the service writes the mode that it wants into one word, with the
///    reason, and wakes a thread of the container.
/// 2. That thread changes `serving` of the callbacks that are served otherwise in that mode. Their
///    executors apply this as any other parameter: at their next dispatch.
/// 3. The thread reads the word again, until the requested mode is in force.
///
/// An overrun never switches back: only to modes further down in the file than the requested one.
/// Thread safety: from any thread.
/// Real-time: request and overrun neither allocate nor block; the rest does.
class Modes {
 public:
  enum class Cause : std::uint32_t { service, component, overrun };
  // Limit: mode switches that a container remembers. At it: the oldest is forgotten.
  // Seen: `mode_switches` of the result has as many.
  static constexpr std::size_t kMostSwitches = 1000;

  explicit Modes(const std::vector<ModeDescription>& described);

  /// For components. Returns false if there is no such mode.
  bool request(std::string_view name) noexcept;
  /// Call it when a callback overruns whose overrun leads to the mode of this number.
  void overrun(std::size_t mode) noexcept;
  /// For the service, which must call follow() afterwards. Throws Error, which lists the names, if
  /// there is no such mode.
  void want(const std::string& name);
  /// The same before anything runs: the mode is in force at once.
  void begin_in(const std::string& name);
  /// `request` and `overrun` trigger this guard condition. It must live as long as they are called,
  /// or until nullptr replaces it. It is triggered at once, for a mode that was requested before.
  void set_waker(GuardCondition* waker) noexcept {
    waker_.store(waker);
    wake();
  }

  /// How the callback "node/callback" is served in the mode of this number. A coroutine that has
  /// begun still ends: if its callback is dropped, what is left of it is demoted.
  Serving serving(std::size_t mode, const std::string& callback) const;
  /// Brings the requested mode into force: calls `apply(number)` for each mode on the way. One
  /// thread at a time. If `apply` throws, the exception leaves this function, and the mode stays.
  template <class Apply>
  void follow(Clock& clock, Apply&& apply) {
    const std::lock_guard lock(mutex_);
    for (Wanted wanted = wanted_.load(); wanted.mode != in_force_; wanted = wanted_.load()) {
      const TimePoint begin = clock.now();
      apply(wanted.mode);
      in_force_ = wanted.mode;
      note(wanted, begin, clock.now());
    }
  }
  /// Serves the callbacks of the node as the mode of this number says.
  void serve_as_in(std::size_t mode, const std::shared_ptr<Node>& node) const;
  /// Serves the node's callbacks as the mode in force says, which does not change meanwhile.
  void serve_as_in_force(const std::shared_ptr<Node>& node) const;

  /// The process in the mode of this number, for make_system_model.
  ModelledProcess modelled(std::size_t mode, ModelledProcess process) const;

  std::string in_force() const;
  /// `start`: when the timers started.
  std::vector<ProcessResult::ModeSwitch> switches(TimePoint start = {}) const;
  std::vector<std::string> names() const;
  /// All modes; the first one is "normal", without changes.
  const std::vector<ModeDescription>& all() const noexcept { return modes_; }

 private:
  struct alignas(8) Wanted {  // aligned: else clang's atomic calls a library
    std::uint32_t mode = 0;
    Cause cause = Cause::service;
  };
  void wake() noexcept;
  void note(const Wanted& wanted, TimePoint begin, TimePoint end);

  const std::vector<ModeDescription> modes_;
  std::atomic<Wanted> wanted_{};
  std::atomic<GuardCondition*> waker_{nullptr};
  // Not a PiMutex: schedulers of users are made while it is held, and no callback waits for it.
  mutable std::mutex mutex_;  // guards what follows
  std::uint32_t in_force_ = 0;
  std::vector<ProcessResult::ModeSwitch> switches_;
};

/// As a file names a callback: "node/callback".
std::string name_in_modes(const std::shared_ptr<Node>& node, const Entity& entity);

/// A handler of overruns and missed deadlines that requests a mode, then calls the callback's own
/// handler.
struct OverrunLeadsToMode {
  std::shared_ptr<Modes> modes;
  std::size_t mode;
  OverrunHandler besides;
  void operator()(const OverrunReport& report) const {
    modes->overrun(mode);
    if (besides) besides(report);
  }
};
/// Whether the handler calls code of a user.
bool is_of_user(const OverrunHandler& handler);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODES_HPP_
