// What the fields of a row of figures are: for what adds rows up, writes and reads them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_FIELDS_HPP_
#define TAKT_BASE_FIELDS_HPP_

#include <cstddef>
#include <functional>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/histogram.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// How the values of two times, or of two threads, become one.
enum class Merge {
  sum,       // numbers and times are added, histograms merged, lists joined
  keep,      // the first one's: it tells what the row is of
  computed,  // no field, but a function of the fields
};

/// Says of a key in files whether those of an earlier Takt lack it.
enum class Since { first, later };

template <Merge kHow, class Member>
struct Field {
  static constexpr Merge kMerge = kHow;
  const char* name;  // its key in files, which ends with the unit: latency_us
  Member member;
  const char* help;
  Since since;
};
template <class Member>
constexpr auto sum(const char* name, Member member, const char* help, Since since = Since::first) {
  return Field<Merge::sum, Member>{name, member, help, since};
}
template <class Member>
constexpr auto keep(const char* name, Member member, const char* help, Since since = Since::first) {
  return Field<Merge::keep, Member>{name, member, help, since};
}
template <class Member>
constexpr auto computed(const char* name, Member member, const char* help) {
  return Field<Merge::computed, Member>{name, member, help, Since::later};
}

/// A member, or a base class, whose fields are fields of the row.
template <class Member>
struct Part {
  Member member;
};
template <class Member>
Part(Member) -> Part<Member>;
template <class Base>
struct BasePart {};

/// A std::tuple of Field, Part and BasePart for each kind of row, which tells all that it consists
/// of: a field without an entry does not compile.
template <class Row>
inline constexpr std::nullptr_t kFields = nullptr;
template <class Row>
inline constexpr bool kIsRow = !std::is_same_v<decltype(kFields<Row>), const std::nullptr_t>;

/// Calls `visit(field, value…)` for each field of rows of one kind, also for those of its parts.
template <class Row, class... Rows>
void for_each_field(const auto& visit, Row& row, Rows&... rows);

namespace detail {

struct Anything {
  template <class T>
  operator T() const;  // NOLINT(google-explicit-constructor)
};
template <class Row, std::size_t... kIndex>
constexpr bool takes(std::index_sequence<kIndex...> /*count*/) {
  return requires {
    Row{(void(kIndex), Anything{})...};
  };
}
/// Of an aggregate, whose bases count as one each.
template <class Row, std::size_t kCount = 0>
constexpr std::size_t count_fields() {
  if constexpr (takes<Row>(std::make_index_sequence<kCount + 1>())) {
    return count_fields<Row, kCount + 1>();
  } else {
    return kCount;
  }
}

template <Merge kHow, class Member>
constexpr bool is_stored(const Field<kHow, Member>& /*field*/) {
  return kHow != Merge::computed;
}
constexpr bool is_stored(const auto& /*part*/) {
  return true;
}
template <class One, class Other>
constexpr bool is_same_member(const One& one, const Other& other) {
  if constexpr (requires { one.member == other.member; }) {
    return one.member == other.member;
  } else {
    return std::is_same_v<One, Other>;
  }
}

template <Merge kHow, class Member, class... Rows>
void visit_entry(const auto& visit, const Field<kHow, Member>& field, Rows&... rows) {
  visit(field, std::invoke(field.member, rows)...);
}
template <class Member, class... Rows>
void visit_entry(const auto& visit, const Part<Member>& part, Rows&... rows) {
  for_each_field(visit, rows.*part.member...);
}
template <class Base, class... Rows>
void visit_entry(const auto& visit, const BasePart<Base>& /*part*/, Rows&... rows) {
  for_each_field(
      visit, static_cast<std::conditional_t<std::is_const_v<Rows>, const Base, Base>&>(rows)...);
}

}  // namespace detail

/// Whether these entries describe each field of the row once.
template <class Row, class... Entries>
constexpr bool describe_all(const std::tuple<Entries...>& entries) {
  return std::apply(
      [](const auto&... entry) {
        const auto times = [&](const auto& one) {
          return (0 + ... + (detail::is_same_member(one, entry) ? 1 : 0));
        };
        const std::size_t stored = (std::size_t{0} + ... + (detail::is_stored(entry) ? 1 : 0));
        return stored == detail::count_fields<Row>() && (... && (times(entry) == 1));
      },
      entries);
}

template <class Row, class... Rows>
void for_each_field(const auto& visit, Row& row, Rows&... rows) {
  static constexpr const auto& kEntries = kFields<std::remove_const_t<Row>>;
  static_assert(describe_all<std::remove_const_t<Row>>(kEntries),
                "a field of this row has no entry in its kFields, or two");
  std::apply([&](const auto&... entry) { (detail::visit_entry(visit, entry, row, rows...), ...); },
             kEntries);
}

template <class T>
void add_to(T& sum, const T& more) {
  sum += more;
}
inline void add_to(Histogram& sum, const Histogram& more) noexcept {
  sum.merge(more);
}
template <class T>
void add_to(std::vector<T>& sum, const std::vector<T>& more) {
  sum.insert(sum.end(), more.begin(), more.end());
}
template <class T>
void add_to(std::optional<T>& sum, const std::optional<T>& more) {
  if (more) add_to(sum ? *sum : sum.emplace(), *more);
}

/// Adds what was measured of the same at another time, or of another of its kind.
template <class Row>
void merge(Row& sum, const Row& more) {
  for_each_field(
      []<Merge kHow, class Member>(const Field<kHow, Member>&, auto&& into, const auto& from) {
        if constexpr (kHow == Merge::sum) add_to(into, from);
      },
      sum, more);
}

}  // namespace takt

#endif  // TAKT_BASE_FIELDS_HPP_
