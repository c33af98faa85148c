// The parameters that a node has declared.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_PARAMETERS_HPP_
#define TAKT_NODES_NODE_PARAMETERS_HPP_

#include <atomic>
#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/nodes/parameter.hpp"

namespace takt {

/// Called with values before they are set; may reject them all with a reason.
using OnSetParametersCallback = std::function<SetParametersResult(const Parameters&)>;
/// Keeps the callback: when it is dropped, no further call begins.
using OnSetParametersHandle = std::shared_ptr<const OnSetParametersCallback>;

/// Called with values after they were set, or declared (`are_new`), on the thread that did so.
using ParametersListener = std::function<void(const Parameters& values, bool are_new)>;

/// Names, values and descriptors. Node forwards to it, and documents each method.
///
/// Thread safety: every method from any thread. While callbacks are called, other threads that set
/// values wait; a reader waits no longer than for a look-up and a copy.
/// Real-time: get of a boolean or a number takes a lock with priority inheritance, and allocates
/// nothing; a string or an array is copied. The rest is set-up.
class NodeParameters {
 public:
  /// `node` is its name in errors; `given` what the configuration says.
  NodeParameters(std::string node, Parameters given)
      : node_(std::move(node)), given_(std::move(given)) {}

  template <class T>
  T declare(std::string_view name, T value, ParameterDescriptor descriptor) {
    return as<T>(name,
                 declare(name, {widened(std::move(value)), std::move(descriptor), limits<T>()}));
  }
  template <class T>
  T get(std::string_view name) const {
    return as<T>(name, value(name));
  }
  bool has(std::string_view name) const;
  ParameterDescriptor describe(std::string_view name) const;
  ListParametersResult list(const std::vector<std::string>& prefixes, std::uint64_t depth) const;
  SetParametersResult set_atomically(const Parameters& values);
  OnSetParametersHandle add_callback(OnSetParametersCallback callback);
  /// Empty: none. When this returns, the previous listener is not called any more. It may read
  /// parameters, but not set or declare any.
  void set_listener(ParametersListener listener);
  /// What is given and was not declared.
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
  // With the mutex held.
  const Declared& find(std::string_view name) const;
  void check_ranges(std::string_view name, const Declared& declared) const;
  ParameterValue accepted(std::string_view name, const ParameterValue& given,
                          const Declared& declared) const;
  SetParametersResult ask_callbacks(const Parameters& values);
  void set(Parameters values);

  const std::string node_;
  const Parameters given_;

  PiMutex change_mutex_;  // held while values are set; comes before mutex_
  std::atomic<std::thread::id> changing_thread_{};
  ParametersListener listener_;  // guarded by change_mutex_

  mutable PiMutex mutex_;  // guards all below
  std::map<std::string, Declared, std::less<>> declared_;
  std::vector<std::weak_ptr<const OnSetParametersCallback>> callbacks_;
};

}  // namespace takt

#endif  // TAKT_NODES_NODE_PARAMETERS_HPP_
