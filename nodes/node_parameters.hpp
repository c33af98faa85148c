// The parameters that a node has declared.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_PARAMETERS_HPP_
#define TAKT_NODES_NODE_PARAMETERS_HPP_

#include <atomic>
#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/parameter.hpp"

namespace TAKT_PUBLIC takt {

/// Called first, with the values that are to be set; may change, add and remove some.
using PreSetParametersCallback = std::function<void(Parameters&)>;
/// Called with values before they are set; may reject them all with a reason.
using OnSetParametersCallback = std::function<SetParametersResult(const Parameters&)>;
/// Called with values after they were set.
using PostSetParametersCallback = std::function<void(const Parameters&)>;
/// Keeps the callback: when it is dropped, no further call begins.
template <class Callback>
using ParametersHandle = std::shared_ptr<const Callback>;
using PreSetParametersHandle = ParametersHandle<PreSetParametersCallback>;
using OnSetParametersHandle = ParametersHandle<OnSetParametersCallback>;
using PostSetParametersHandle = ParametersHandle<PostSetParametersCallback>;

/// Called after parameters were declared, set or undeclared, on the thread that did so.
using ParametersListener = std::function<void(const ParameterChanges&)>;

/// Names, values and descriptors. Node forwards to it, and documents each method.
///
/// Thread safety: every method from any thread. While callbacks are called, other threads that set
/// values wait; a reader waits no longer than for a look-up and a copy.
/// Real-time: get of a boolean or a number takes a lock with priority inheritance, and allocates
/// nothing; a string or an array is copied. The rest is set-up.
class NodeParameters {
 public:
  /// `node` is its name in errors; `given` what the configuration says.
  NodeParameters(std::string node, Parameters given);

  template <class T>
  T declare(std::string_view name, T value, ParameterDescriptor descriptor) {
    return as<T>(name,
                 declare(name, {widened(std::move(value)), std::move(descriptor), limits<T>()}));
  }
  template <class T>
  T get(std::string_view name) const {
    return as<T>(name, value(name));
  }
  template <class T>
  T get_or(std::string_view name, T alternative) const {
    ParameterValue value = value_if_set(name);
    if (std::holds_alternative<std::monostate>(value)) return alternative;
    return as<T>(name, std::move(value));
  }
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
  // What the integer type of the code can hold.
  struct Limits {
    std::int64_t lowest = std::numeric_limits<std::int64_t>::min();
    std::int64_t highest = std::numeric_limits<std::int64_t>::max();
  };
  struct Declared {
    ParameterValue value;
    ParameterDescriptor descriptor;
    Limits limits;
  };
  template <class Callback>
  using Callbacks = std::vector<std::weak_ptr<const Callback>>;
  class Changing;

  template <class T>
  static constexpr bool kIsInteger = std::integral<T> && !std::same_as<T, bool>;
  template <class T>
  static constexpr Limits limits() {
    Limits limits;
    if constexpr (kIsInteger<T>) {
      using Own = std::numeric_limits<T>;
      limits.lowest = static_cast<std::int64_t>(Own::min());
      if constexpr (std::is_signed_v<T> || sizeof(T) < sizeof(std::int64_t)) {
        limits.highest = static_cast<std::int64_t>(Own::max());
      }
    }
    return limits;
  }
  // int and float literals become the parameter types int64 and double.
  template <class T>
  static auto widened(T value) {
    if constexpr (kIsInteger<T>) {
      return static_cast<std::int64_t>(value);
    } else if constexpr (std::floating_point<T>) {
      return static_cast<double>(value);
    } else if constexpr (std::convertible_to<T, std::string>) {
      return std::string(std::move(value));
    } else {
      return value;
    }
  }
  template <class T>
  T as(std::string_view name, ParameterValue value) const {
    if constexpr (std::same_as<T, ParameterValue>) {
      return value;
    } else {
      using Stored = decltype(widened(std::declval<T>()));
      auto* stored = std::get_if<Stored>(&value);
      if (stored == nullptr) throw_wrong_type(name, value, ParameterValue(Stored{}));
      if constexpr (kIsInteger<T>) {
        if (*stored < limits<T>().lowest || *stored > limits<T>().highest) {
          throw_too_narrow(name, value);
        }
      }
      return static_cast<T>(std::move(*stored));
    }
  }
  [[noreturn]] void throw_wrong_type(std::string_view name, const ParameterValue& is,
                                     const ParameterValue& wanted) const;
  [[noreturn]] void throw_too_narrow(std::string_view name, const ParameterValue& is) const;

  ParameterValue declare(std::string_view name, Declared declared);
  ParameterValue value(std::string_view name) const;
  ParameterValue value_if_set(std::string_view name) const;
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

#endif  // TAKT_NODES_NODE_PARAMETERS_HPP_
