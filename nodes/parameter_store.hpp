// The parameters that a node has declared.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_PARAMETER_STORE_HPP_
#define TAKT_NODES_PARAMETER_STORE_HPP_

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/parameter.hpp"

namespace takt {

/// Names, values and descriptors. Node forwards to it, and documents each method.
///
/// Users' callbacks run without a lock, in these steps:
/// 1. Pre-set and on-set callbacks are called for what is to be set. Several threads may do so at
///    the same time.
/// 2. If another thread has changed a parameter meanwhile, the callbacks have checked values
///    that have gone: step 1 again, for a few times; then the answer is negative.
/// 3. The values are changed, and the listener is called.
/// 4. The values wait for the post-set callbacks. If no thread is calling those, this one does, for
///    all changes that wait and come meanwhile, in their order; else it leaves them to the one that
///    is. So no thread waits for another one's callbacks.
///
/// Thread safety: every method from any thread. A reader waits no longer than for a look-up and a
/// copy, one that changes parameters no longer than for the listener.
/// Real-time: get of a boolean or a number takes a lock with priority inheritance, and allocates
/// nothing; a string or an array is copied. The rest is set-up.
class ParameterStore {
 public:
  /// As NodeOptions has them.
  struct Rules {
    bool allows_undeclared = false, are_types_exact = false;
  };
  /// `node` is its name in errors; `given` what the configuration says.
  ParameterStore(std::string node, Parameters given, const Rules& rules);

  /// `wanted`: its default value, as the code has it.
  ParameterValue declare(std::string_view name, ParameterValue wanted,
                         ParameterDescriptor descriptor, const detail::IntegerLimits& limits);
  ParameterValue get(std::string_view name) const;
  /// Not set when it was not declared.
  ParameterValue get_if_set(std::string_view name) const;
  std::vector<Parameter> get(const std::vector<std::string>& names) const;
  Parameters get_by_prefix(std::string_view prefix) const;
  void undeclare(std::string_view name);
  bool has(std::string_view name) const;
  std::vector<ParameterDescriptor> describe(const std::vector<std::string>& names) const;
  ListParametersResult list(const std::vector<std::string>& prefixes, std::uint64_t depth) const;
  SetParametersResult set_atomically(const Parameters& values);
  std::vector<SetParametersResult> set(const std::vector<Parameter>& parameters);
  PreSetParametersHandle add_pre_set(PreSetParametersCallback callback) {
    return pre_set_.add_owned(std::move(callback));
  }
  OnSetParametersHandle add_on_set(OnSetParametersCallback callback) {
    return on_set_.add_owned(std::move(callback));
  }
  PostSetParametersHandle add_post_set(PostSetParametersCallback callback) {
    return post_set_.add_owned(std::move(callback));
  }
  /// Empty: none. When this returns, the previous listener is not called any more. It hears of
  /// changes in their order. It is called with a lock held: it may read parameters, and nothing
  /// else of the store.
  void set_listener(ParametersListener listener);
  /// The node's own callbacks: `check` throws Error when it refuses what would change, with a lock
  /// held; `act` is called before post-set callbacks, as they are. Before other threads know the
  /// node.
  using ParametersCheck = std::function<void(const Parameters&)>;
  void set_own(ParametersCheck check, PostSetParametersCallback act) {
    check_ = std::move(check);
    act_ = std::move(act);
  }
  /// Parameters that were given and never declared.
  std::vector<std::string> unused() const;

 private:
  struct Declared {
    ParameterValue value;
    ParameterDescriptor descriptor;
    detail::IntegerLimits limits;
  };
  using ChangeMutex = RankedMutex<LockRank::parameters>;
  using Lock = std::unique_lock<ChangeMutex>;
  /// What has changed, and the stores whose callbacks have led to it.
  struct Change {
    Parameters values;
    std::vector<std::uint64_t> causes;
  };
  class Cause;

  static std::uint64_t next_id() noexcept;
  // Not set: another thread has changed something while callbacks were called.
  std::optional<ParameterValue> try_to_declare(std::string_view name, const Declared& wanted);
  std::optional<SetParametersResult> try_to_set(Parameters values);
  std::string disturbed() const;

  // With `change_mutex_` held, which those with a lock release while they call.
  // The latest callback first, until a call returns false.
  template <class List, class Use>
  static void each(Lock& lock, List& callbacks, Use&& use);
  SetParametersResult ask_callbacks(Lock& lock, const Parameters& values);
  void check_backlog() const;
  void apply(ParameterChanges changes);
  void report(const ParameterChanges& changes, Parameters values);
  void call_post_set();

  // With `mutex_` held.
  const Declared& find(std::string_view name) const;
  /// With one of any type in place of what may be undeclared.
  const Declared& find_or_unset(std::string_view name) const;
  void check_descriptor(std::string_view name, const Declared& declared) const;
  void check_undeclaring(std::string_view name, const Declared& declared) const;
  ParameterValue accepted(std::string_view name, const ParameterValue& given,
                          const Declared& declared) const;
  ParameterChanges checked(const Parameters& values) const;

  const std::uint64_t id_ = next_id();  // no other store has it, now or later
  const std::string node_;
  const Parameters given_;
  const Rules rules_;
  ParametersCheck check_;
  PostSetParametersCallback act_;

  ChangeMutex change_mutex_;     // held while something changes. Guards:
  std::uint64_t version_ = 0;    // counts changes
  std::deque<Change> finished_;  // changes whose post-set callbacks have not been called
  bool calls_post_set_ = false;  // a thread does
  ParametersListener listener_;

  mutable PiMutex mutex_;  // guards all below
  std::map<std::string, Declared, std::less<>> declared_;
  std::set<std::string, std::less<>> unused_;

  detail::CallbackList<void(Parameters&)> pre_set_;
  detail::CallbackList<SetParametersResult(const Parameters&)> on_set_;
  detail::CallbackList<void(const Parameters&)> post_set_;
};

}  // namespace takt

#endif  // TAKT_NODES_PARAMETER_STORE_HPP_
