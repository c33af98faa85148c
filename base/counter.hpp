// A number that one thread writes, and any thread reads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_COUNTER_HPP_
#define TAKT_BASE_COUNTER_HPP_

#include <atomic>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// What is counted on a thread that must not pay for readers: plain loads and stores, no locked
/// instruction.
/// Thread safety: one writer at a time, readers at any time.
/// Real-time: neither blocks nor allocates.
template <class T = std::uint64_t>
class Counter {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): it is used as the number that it is.
  constexpr Counter(T value = T{}) noexcept : value_(value) {}
  Counter(const Counter& other) noexcept : value_(other.load()) {}
  // Relaxed: readers see each number by itself. What belongs to it is read after publish().
  Counter& operator=(T value) noexcept {
    value_.store(value, std::memory_order_relaxed);
    return *this;
  }
  Counter& operator=(const Counter& other) noexcept { return *this = other.load(); }
  Counter& operator+=(T more) noexcept { return *this = static_cast<T>(own() + more); }
  Counter& operator++() noexcept { return *this += T{1}; }
  /// As an assignment: a reader that sees it sees all that the writer has written before.
  void publish(T value) noexcept {
    value_.store(value, std::memory_order_release);  // pairs with load()
  }

  /// The writer's own last value.
  T own() const noexcept { return value_.load(std::memory_order_relaxed); }
  // Acquire: pairs with publish().
  T load() const noexcept { return value_.load(std::memory_order_acquire); }
  operator T() const noexcept { return load(); }  // NOLINT(google-explicit-constructor)

 private:
  std::atomic<T> value_;
  static_assert(std::atomic<T>::is_always_lock_free);
};

}  // namespace takt

#endif  // TAKT_BASE_COUNTER_HPP_
