// A function of the user that an object of Takt owns.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_USER_FUNCTION_HPP_
#define TAKT_BASE_USER_FUNCTION_HPP_

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "takt/base/held_locks.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

template <class Signature>
class UserFunction;

template <class F>
inline constexpr bool kIsStdFunction = false;
template <class Signature>
inline constexpr bool kIsStdFunction<std::function<Signature>> = true;

/// A function that is neither called nor destroyed under one of our locks: what it captures
/// may own what waits for that lock. In debug and sanitizer builds the program ends if it happens,
/// see held_locks.hpp. It can be moved under a lock, and released after it. Unlike a std::function
/// it can hold what cannot be copied. Thread safety: as std::function. Real-time: it allocates only
/// for what is larger than a std::function, or may throw when it is moved; moving neither blocks
/// nor allocates.
template <class Result, class... Arguments>
class UserFunction<Result(Arguments...)> {
 public:
  UserFunction() = default;
  UserFunction(std::nullptr_t) noexcept {}
  template <class F, class Owned = std::decay_t<F>>
  requires(!std::is_same_v<Owned, UserFunction> &&
           std::is_invocable_r_v<Result, Owned&, Arguments...>) UserFunction(F&& function) {
    if constexpr (kIsStdFunction<Owned> || std::is_pointer_v<Owned>) {
      if (function == nullptr) return;
    }
    if constexpr (kFits<Owned>) {
      ::new (place()) Owned(std::forward<F>(function));
      set<Owned>();
    } else {
      ::new (place()) Elsewhere<Owned>{std::make_unique<Owned>(std::forward<F>(function))};
      set<Elsewhere<Owned>>();
    }
  }
  UserFunction(UserFunction&& other) noexcept { take(other); }
  UserFunction& operator=(UserFunction&& other) noexcept {
    UserFunction old(std::move(*this));
    take(other);
    return *this;
  }
  ~UserFunction() {
    if (call_ == nullptr) return;
    expect_no_lock("function");
    kind_->destroy(place());
  }

  explicit operator bool() const noexcept { return call_ != nullptr; }
  Result operator()(Arguments... arguments) const {
    expect_no_lock("function");
    if (call_ == nullptr) throw std::bad_function_call();
    return call_(place(), std::forward<Arguments>(arguments)...);
  }

 private:
  static constexpr std::size_t kBytes = sizeof(std::function<void()>);
  template <class F>
  static constexpr bool kFits =
      sizeof(F) <= kBytes &&
      alignof(F) <= alignof(void*) && std::is_nothrow_move_constructible_v<F>;
  template <class F>
  static Result run(F& function, Arguments... arguments) {
    if constexpr (std::is_void_v<Result>) {
      std::invoke(function, std::forward<Arguments>(arguments)...);
    } else {
      return std::invoke(function, std::forward<Arguments>(arguments)...);
    }
  }
  template <class F>
  struct Elsewhere {
    std::unique_ptr<F> function;
    Result operator()(Arguments... arguments) {
      return run(*function, std::forward<Arguments>(arguments)...);
    }
  };
  struct Kind {
    void (*move)(void* from, void* to) noexcept;  // `from` is destroyed
    void (*destroy)(void* place) noexcept;
  };
  template <class F>
  static F& in(void* place) noexcept {
    return *std::launder(static_cast<F*>(place));
  }
  template <class F>
  static Result call(void* place, Arguments... arguments) {
    return run(in<F>(place), std::forward<Arguments>(arguments)...);
  }
  template <class F>
  static constexpr Kind kKindOf = {[](void* from, void* to) noexcept {
                                     ::new (to) F(std::move(in<F>(from)));
                                     std::destroy_at(&in<F>(from));
                                   },
                                   [](void* place) noexcept { std::destroy_at(&in<F>(place)); }};
  template <class F>
  void set() noexcept {
    call_ = &call<F>;
    kind_ = &kKindOf<F>;
  }

  // Calling it is const, as with std::function.
  void* place() const noexcept { return const_cast<std::byte*>(bytes_.data()); }
  void take(UserFunction& other) noexcept {
    call_ = std::exchange(other.call_, nullptr);
    kind_ = other.kind_;
    if (call_ != nullptr) kind_->move(other.place(), place());
  }

  Result (*call_)(void* place, Arguments... arguments) = nullptr;  // nullptr: it is empty
  const Kind* kind_ = nullptr;
  alignas(void*) std::array<std::byte, kBytes> bytes_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_BASE_USER_FUNCTION_HPP_
