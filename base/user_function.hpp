// A function of the user that an object of Takt owns.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_USER_FUNCTION_HPP_
#define TAKT_BASE_USER_FUNCTION_HPP_

#include <functional>
#include <utility>

#include "takt/base/held_locks.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

template <class Signature>
class UserFunction;

/// A std::function that is neither called nor destroyed under one of our locks: what it captures
/// may own what waits for that lock. In debug and sanitizer builds the program ends if it happens,
/// see held_locks.hpp. It can be moved under a lock, and released after it. Thread safety: as
/// std::function. Real-time: as std::function; moving neither blocks nor allocates.
template <class Result, class... Arguments>
class UserFunction<Result(Arguments...)> {
 public:
  UserFunction() = default;
  UserFunction(std::function<Result(Arguments...)> function) noexcept
      : function_(std::move(function)) {}
  UserFunction(UserFunction&& other) noexcept
      : function_(std::exchange(other.function_, nullptr)) {}
  UserFunction& operator=(UserFunction&& other) noexcept {
    UserFunction old(std::move(*this));
    function_.swap(other.function_);
    return *this;
  }
  ~UserFunction() {
    if (function_) expect_no_lock("function");
  }

  explicit operator bool() const noexcept { return static_cast<bool>(function_); }
  Result operator()(Arguments... arguments) const {
    expect_no_lock("function");
    return function_(std::forward<Arguments>(arguments)...);
  }

 private:
  std::function<Result(Arguments...)> function_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_BASE_USER_FUNCTION_HPP_
