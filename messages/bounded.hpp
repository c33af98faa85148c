// Strings and sequences with a bound, like IDL's string<5> and sequence<double, 3>.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_BOUNDED_HPP_
#define TAKT_MESSAGES_BOUNDED_HPP_

#include <concepts>
#include <cstddef>
#include <initializer_list>
#include <iterator>
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
  using typename Container::const_iterator;
  using typename Container::const_reference;
  using typename Container::iterator;
  using typename Container::reference;
  using typename Container::size_type;
  using typename Container::value_type;

  Bounded() = default;
  Bounded(Container values) : Container(std::move(values)) { check(size()); }
  Bounded(std::initializer_list<value_type> values) : Bounded(Container(values)) {}
  Bounded(const char* text) requires std::same_as<Container, std::string>
      : Bounded(Container(text)) {}

  static constexpr std::size_t max_size() noexcept { return kMost; }
  const Container& get() const noexcept { return *this; }
  operator const Container&() const noexcept { return *this; }
  /// Moves the container out, with its memory.
  Container take() && { return std::move(static_cast<Container&>(*this)); }

  using Container::at;
  using Container::back;
  using Container::begin;
  using Container::capacity;
  using Container::cbegin;
  using Container::cend;
  using Container::clear;
  using Container::data;
  using Container::empty;
  using Container::end;
  using Container::erase;
  using Container::front;
  using Container::operator[];
  using Container::pop_back;
  using Container::rbegin;
  using Container::rend;
  using Container::reserve;
  using Container::size;
  const char* c_str() const noexcept requires std::same_as<Container, std::string> {
    return Container::c_str();
  }
  void push_back(value_type value) {
    check_room(1);
    Container::push_back(std::move(value));
  }
  template <class... Arguments>
  decltype(auto) emplace_back(Arguments&&... arguments) {
    check_room(1);
    return Container::emplace_back(std::forward<Arguments>(arguments)...);
  }
  iterator insert(const_iterator before, value_type value) {
    check_room(1);
    return Container::insert(before, std::move(value));
  }
  template <std::forward_iterator Iterator>
  iterator insert(const_iterator before, Iterator first, Iterator last) {
    check_room(static_cast<std::size_t>(std::distance(first, last)));
    return Container::insert(before, first, last);
  }
  void assign(std::size_t count, const value_type& value) {
    check(count);
    Container::assign(count, value);
  }
  template <std::input_iterator Iterator>
  void assign(Iterator first, Iterator last) {
    *this = Bounded(Container(first, last));
  }
  void assign(std::initializer_list<value_type> values) { *this = Bounded(values); }
  void resize(std::size_t count, const value_type& value = {}) {
    check(count);
    Container::resize(count, value);
  }

  friend bool operator==(const Bounded&, const Bounded&) = default;

 private:
  void check_room(std::size_t more) const { check(more > kMost ? more : size() + more); }
  static void check(std::size_t count) {
    if (count > kMost) throw_length_error(count);
  }
  [[noreturn]] static void throw_length_error(std::size_t count) {
    throw std::length_error("at most " + std::to_string(kMost) + " elements fit in; these are " +
                            std::to_string(count));
  }
};

}  // namespace takt

#endif  // TAKT_MESSAGES_BOUNDED_HPP_
