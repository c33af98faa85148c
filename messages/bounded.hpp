// Strings and sequences with a bound, like IDL's string<5> and sequence<double, 3>.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_BOUNDED_HPP_
#define TAKT_MESSAGES_BOUNDED_HPP_

#include <concepts>
#include <cstddef>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A std::string or std::vector with at most `kMost` elements. An operation that would exceed the
/// bound throws std::length_error and changes nothing. `get()` gives read access to the container.
/// Thread safety: as the container. Real-time: as the container.
template <class Container, std::size_t kMost>
class Bounded : private Container {
 public:
  using typename Container::value_type;

  Bounded() = default;
  Bounded(Container values) : Container(std::move(values)) {
    if (size() > kMost) refuse(size());
  }
  Bounded(std::initializer_list<value_type> values) : Bounded(Container(values)) {}
  Bounded(const char* text) requires std::same_as<Container, std::string>
      : Bounded(Container(text)) {}

  static constexpr std::size_t max_size() noexcept { return kMost; }
  const Container& get() const noexcept { return *this; }
  operator const Container&() const noexcept { return *this; }
  /// Moves the container out, with its memory.
  Container take() && { return std::move(static_cast<Container&>(*this)); }

  using Container::back;
  using Container::begin;
  using Container::capacity;
  using Container::clear;
  using Container::data;
  using Container::empty;
  using Container::end;
  using Container::front;
  using Container::operator[];
  using Container::pop_back;
  using Container::reserve;
  using Container::size;
  void push_back(value_type value) {
    if (size() == kMost) refuse(kMost + 1);
    Container::push_back(std::move(value));
  }
  void resize(std::size_t count) {
    if (count > kMost) refuse(count);
    Container::resize(count);
  }

  friend bool operator==(const Bounded&, const Bounded&) = default;

 private:
  [[noreturn]] static void refuse(std::size_t count) {
    throw std::length_error("at most " + std::to_string(kMost) + " elements fit in; these are " +
                            std::to_string(count));
  }
};

}  // namespace takt

#endif  // TAKT_MESSAGES_BOUNDED_HPP_
