// The assumptions that a bound depends on, beside its numbers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_
#define TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A condition that must hold for a bound to be valid.
struct Assumption {
  enum class State {
    checked,      // Takt checks it, at the start or while the system runs
    unchecked,    // nobody checks it; the file may accept it
    refuted,      // the measured run, the component or this machine contradicts it
    not_covered,  // a fact of the file or of a node that no number of the model covers
  };
  std::string id;  // of assumption_kinds(); not_covered: the key
  std::string text;
  std::string source;  // "declared at robot.yaml:7", "measured, n = 1200", "this machine", "nobody"
  State state = State::unchecked;
  std::string accepted;  // the reason that the file gives; empty: the file does not accept it
};
std::string_view to_string(Assumption::State state) noexcept;
/// What stands for the sentences of the assumption: "5f3a9c01". Others have another one.
std::string digest_of(const Assumption& assumption);
/// A key of `accept`: "as_measured", or "as_measured@5f3a9c01". The id, and what stands for the
/// sentences that are accepted; empty: all.
std::pair<std::string_view, std::string_view> split_accepted(std::string_view key) noexcept;

/// One id, for `accept` in a file.
struct AssumptionKind {
  std::string_view id, meaning;
  std::string_view check;    // when Takt checks it in any file; empty: never
  std::string_view watched;  // which part of it `analysis: {watch: true}` observes; empty: nothing
  std::string_view remedy;   // what else removes the need for it, beside a watch and `accept`
  bool is_remedy_of_containers = false;  // the file of a program cannot have it
};
/// When Takt checks the assumption; empty: never. `may_watch`: the file could have a watch, or has
/// one.
std::string check_of(const AssumptionKind& kind, bool may_watch);
/// What removes the need for the assumption, beside `accept`; empty: nothing. `may_watch`: the file
/// could have a watch, and has none.
std::string remedy_of(const AssumptionKind& kind, bool may_watch);
/// All kinds, in the order of their ids.
/// Thread safety: from any thread. Real-time: no.
std::span<const AssumptionKind> assumption_kinds();
/// nullptr: there is no kind with this id.
const AssumptionKind* assumption_kind(std::string_view id) noexcept;

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_ASSUMPTION_HPP_
