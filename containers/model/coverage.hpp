// One table of every fact that a file, a node, a thread and a trace can state, and of every change
// while a system runs: how each counts in a guarantee.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_COVERAGE_HPP_
#define TAKT_CONTAINERS_MODEL_COVERAGE_HPP_

#include <span>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

enum class Coverage {
  used,         // the model has it
  irrelevant,   // it changes no bound
  not_covered,  // a chain with it has no guarantee
};

/// One fact.
struct CoverageEntry {
  /// A kind of map in files, as the reference calls it ("a topic"), a structure ("QoS"), or
  /// "change": something that happens to a running system.
  std::string_view of;
  std::string_view fact;
  Coverage coverage;
  std::string_view why;  // where it is used, why it cannot matter, or what no number covers
  /// Whether no execution time depends on it, so that a run with another value tells the same.
  bool is_free_in_run = false;
};

/// coverage_test.cpp compares the table with the keys of the reader and the fields of the
/// structures, and fails if one has no entry. At run time, a key without an entry is not covered.
/// Thread safety: from any thread. Real-time: no.
std::span<const CoverageEntry> coverage_table();
/// nullptr: the fact has no entry.
const CoverageEntry* coverage_of(std::string_view of, std::string_view fact) noexcept;

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_COVERAGE_HPP_
