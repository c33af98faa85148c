// The parameters that a node has declared.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_PARAMETER_STORE_HPP_
#define TAKT_NODES_PARAMETER_STORE_HPP_

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/parameter.hpp"

namespace takt {

/// Names, values and descriptors. Node forwards to it, and documents each method.
///
/// Thread safety: every method from any thread. While callbacks are called, other threads that set
/// values wait; a reader waits no longer than for a look-up and a copy.
/// Real-time: get of a boolean or a number takes a lock with priority inheritance, and allocates
/// nothing; a string or an array is copied. The rest is set-up.
class ParameterStore {
 public:
  /// `node` is its name in errors; `given` what the configuration says.
  ParameterStore(std::string node, Parameters given);

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
  SetParametersResult set_atomically(Parameters values);
  std::vector<SetParametersResult> set(const std::vector<Parameter>& parameters);
  PreSetParametersHandle add_pre_set(PreSetParametersCallback callback) {
    return add(std::move(callback), pre_set_);
  }
  OnSetParametersHandle add_on_set(OnSetParametersCallback callback) {
    return add(std::move(callback), on_set_);
  }
  PostSetParametersHandle add_post_set(PostSetParametersCallback callback) {
    return add(std::move(callback), post_set_);
  }
  /// Empty: none. When this returns, the previous listener is not called any more. It may read
  /// parameters, but not set or declare any.
  void set_listener(ParametersListener listener);
  /// What is given and was never declared.
  std::vector<std::string> unused() const;

 private:
  struct Declared {
    ParameterValue value;
    ParameterDescriptor descriptor;
    detail::IntegerLimits limits;
  };
  template <class Callback>
  using Callbacks = std::vector<std::weak_ptr<const Callback>>;
  class Changing;

  // With the mutex held.
  const Declared& find(std::string_view name) const;
  void check_descriptor(std::string_view name, const Declared& declared) const;
  void check_undeclaring(std::string_view name, const Declared& declared) const;
  ParameterValue accepted(std::string_view name, const ParameterValue& given,
                          const Declared& declared) const;
  ParameterChanges checked(const Parameters& values) const;
  template <class Callback>
  ParametersHandle<Callback> add(Callback callback, Callbacks<Callback>& callbacks) {
    auto handle = std::make_shared<const Callback>(std::move(callback));
    const std::lock_guard lock(mutex_);
    callbacks.push_back(handle);
    return handle;
  }
  // The latest first, until a call returns false.
  template <class Callback, class Call>
  void each(Callbacks<Callback>& callbacks, Call&& call);
  SetParametersResult ask_callbacks(const Parameters& values);
  void apply(ParameterChanges changes);
  void report(const ParameterChanges& changes, const Parameters& values);

  const std::string node_;
  const Parameters given_;

  PiMutex change_mutex_;  // held while values are set; comes before mutex_
  std::atomic<std::thread::id> changing_thread_{};
  ParametersListener listener_;  // guarded by change_mutex_

  mutable PiMutex mutex_;  // guards all below
  std::map<std::string, Declared, std::less<>> declared_;
  std::set<std::string, std::less<>> unused_;
  Callbacks<PreSetParametersCallback> pre_set_;
  Callbacks<OnSetParametersCallback> on_set_;
  Callbacks<PostSetParametersCallback> post_set_;
};

}  // namespace takt

#endif  // TAKT_NODES_PARAMETER_STORE_HPP_
