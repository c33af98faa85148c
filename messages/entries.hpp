// How long the lists are that another process sends.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_ENTRIES_HPP_
#define TAKT_MESSAGES_ENTRIES_HPP_

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/bounded.hpp"
#include "takt/messages/cdr.hpp"

namespace TAKT_INTERNAL takt {

// Every count of another process has this limit before work begins that depends on it: a single
// request would otherwise hold up all others.
// Limit: entries of a list (of parameters, names, rules, rows) in a request or an answer of
// another process. At it: a longer one is refused. Seen: the answer; a note.
inline constexpr std::size_t kMostEntries = 10'000;

/// Finds the longest list of a message, of those whose elements are not numbers: what is done with
/// these costs no more than what it took to receive them.
/// Thread safety: none. Real-time: allocates nothing.
class LongestList {
 public:
  std::size_t entries() const noexcept { return entries_; }

  template <CdrPrimitive T>
  void operator()(const T&) {}
  void operator()(const std::string&) {}
  void operator()(const std::u16string&) {}
  template <class T>
  void operator()(const std::vector<T>& values) {
    if constexpr (!CdrPrimitive<T>) {
      entries_ = std::max(entries_, values.size());
      for (const T& value : values) (*this)(value);
    }
  }
  template <class Container, std::size_t kMost>
  void operator()(const Bounded<Container, kMost>& values) {
    (*this)(values.get());
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T& value : values) (*this)(value);
  }
  template <class T>
  void operator()(const T& message) {
    takt_visit_fields(*this, message);
  }
  void no_fields() {}

 private:
  std::size_t entries_ = 0;
};

/// Why a message is not looked at; empty: all its lists are short enough.
template <class Message>
std::string why_too_long(const Message& message) {
  LongestList longest;
  longest(message);
  if (longest.entries() <= kMostEntries) return {};
  return fmt::format("a list of {} entries is refused; send {} at most", longest.entries(),
                     kMostEntries);
}

}  // namespace takt

#endif  // TAKT_MESSAGES_ENTRIES_HPP_
