// What a bound rests on besides its numbers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_
#define TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_

#include <span>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// What must be so for a bound to hold.
struct Assumption {
  enum class State {
    checked,      // Takt looks, at the start or while the system runs
    unchecked,    // nobody looks; the file may accept it
    refuted,      // the measured run, the component or this machine shows that it is not so
    not_covered,  // a fact of the file or of a node of which no number of the model tells
  };
  std::string id;  // of assumption_kinds(); not_covered: the key
  std::string text;
  std::string source;  // "declared at robot.yaml:7", "measured, n = 1200", "this machine", "nobody"
  State state = State::unchecked;
  std::string accepted;  // the reason that the file gives; empty: it does not accept it
};
std::string_view to_string(Assumption::State state) noexcept;

/// One id, for `accept` in a file.
struct AssumptionKind {
  std::string_view id, meaning;
  std::string_view check;    // when Takt looks, whatever the file; empty: it does not
  std::string_view watched;  // what of it `analysis: {watch: true}` sees; empty: nothing
  std::string_view remedy;   // what makes it needless, beside that and `accept`
  bool is_remedy_of_containers = false;  // the file of a program cannot have it
};
/// When Takt looks; empty: it cannot. `may_watch`: the file could have a watch, or has one.
std::string check_of(const AssumptionKind& kind, bool may_watch);
/// What makes it needless, beside `accept`; empty: nothing. `may_watch`: the file could have a
/// watch, and has none.
std::string remedy_of(const AssumptionKind& kind, bool may_watch);
/// All, in the order of their ids.
/// Thread safety: from any thread. Real-time: no.
std::span<const AssumptionKind> assumption_kinds();
/// nullptr: there is none of this id.
const AssumptionKind* assumption_kind(std::string_view id) noexcept;

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_
