// Bounds for a whole system: every executor, and chains over several of them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_ANALYSIS_HPP_
#define TAKT_ANALYSIS_ANALYSIS_HPP_

#include <cstddef>
#include <string>
#include <vector>

#include "takt/analysis/system.hpp"
#include "takt/base/error.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC analysis {

struct Options {
  std::vector<std::string> methods;  // by name; empty: all
  Time limit = 60'000'000'000;       // larger bounds count as none: a minute of nanoseconds
  bool explains = false;             // segments have terms
};

/// The answer of one method.
struct MethodBound {
  std::string method;
  Time bound = kUnbounded;
  std::string why_not;  // if it has none
};

/// The callbacks of a chain that follow each other in one executor.
struct SegmentBound {
  std::size_t executor = 0;
  std::vector<std::size_t> callbacks;
  Time bound = kUnbounded;  // from the arrival of its first message or release to its end
  Time longest_gap = 0;     // between two such arrivals
  Time wait = 0;            // behind it, for the other inputs of a join
  std::string why_not;      // if there is none: what it is due to, wherever that is
  std::vector<MethodBound> methods;
  std::vector<Term> terms;  // of the least bound, if asked for
};

struct ChainBound {
  Time bound = kUnbounded;  // from the release of the first callback to the end of the last one
  std::string why_not;      // if there is none
  std::vector<SegmentBound> segments;
};

struct CallbackBound {
  Time bound = kUnbounded;     // from the arrival that causes it in its executor, to its end
  Count backlog = kUnbounded;  // the most messages that wait for it at a time
  std::string method, why_not;
};

struct Bounds {
  std::vector<ChainBound> chains;        // as in the system
  std::vector<CallbackBound> callbacks;  // as in the system
};

/// An executor of the system has more paths of callbacks than are analysed.
/// Thread safety: as Error. Real-time: no.
class TooManyPaths : public Error {
 public:
  TooManyPaths(std::size_t executor, const std::string& what) : Error(what), executor_(executor) {}
  std::size_t executor() const noexcept { return executor_; }

 private:
  std::size_t executor_;
};

/// The least bounds of all methods whose assumptions hold. What an executor makes late comes to the
/// next with jitter, so all are solved together: from no jitter upwards until nothing changes,
/// which is the least solution, since no bound falls when jitter grows.
///
/// Times are those of the callbacks, and what `overheads` adds.
///
/// Throws Error, with the name, for numbers that are no system: indices and times out of range, a
/// chain of which no output leads from one callback to the next, callbacks that send to each other
/// in a circle; and for an unknown method. TooManyPaths is one, too.
///
/// Source: Tindell, Clark: "Holistic schedulability analysis for distributed hard real-time
/// systems", 1994.
///
/// Thread safety: a pure function.
/// Real-time: no.
Bounds analyze(const System& system, const Options& options = {});

/// By executor, whether a bound of its callbacks grows with this overhead: whether it pays for it.
/// Two analyses, which throw as analyze() does. Thread safety: a pure function. Real-time: no.
std::vector<bool> pays(const System& system, Time Overheads::*overhead,
                       const Options& options = {});

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_ANALYSIS_HPP_
