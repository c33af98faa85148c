// How an analysis is written: a bound for what one executor makes of one arrival.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_METHOD_HPP_
#define TAKT_ANALYSIS_METHOD_HPP_

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "takt/analysis/system.hpp"
#include "takt/base/registry.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_INTERNAL analysis {

/// Arrivals at a callback from outside its executor: of a timer, of other executors, or from
/// outside the system.
struct Source {
  std::size_t callback = 0;
  ArrivalCurve curve;
  Count messages = 1;             // at each arrival
  Time longest_gap = kUnbounded;  // from one arrival to the next
  /// The output that they come from: the callback, and the source of its executor; none: the
  /// callback's own arrivals.
  struct From {
    std::size_t callback, source;
  };
  std::optional<From> from;
};

/// When a callback runs that an arrival causes, counted from that arrival.
struct Span {
  Time earliest_release = 0, latest_release = 0;  // of its own arrival
  Time earliest_end = 0, latest_end = 0;
};

/// Why something has no bound: the executor where that begins, and what is the matter there.
struct Cause {
  std::string executor, what;
};

/// One executor, while it is analysed: what arrives, and what it causes.
struct Part {
  const System& system;
  const Executor& executor;
  std::vector<std::size_t> callbacks;  // all of the executor
  std::vector<Source> sources;
  std::vector<std::map<std::size_t, Count>> caused;        // by source: executions of each callback
  std::map<std::size_t, std::vector<std::size_t>> causes;  // by callback: the sources that do
  std::vector<std::map<std::size_t, Span>> spans;          // by source: as far as known already
  // By source, of one arrival: the time of all that it causes here, and how many executions.
  std::vector<Time> costs;
  std::vector<Count> counts;
  std::vector<const Part*> above;     // other executors on its CPUs that are as urgent or more
  std::vector<const Part*> movers;    // see Executor::movers
  Supply supply;                      // what they leave, or what a reservation grants
  std::vector<const Part*> realtime;  // all that share System::for_realtime with it, itself too
  bool is_throttled = false;          // they may want more than that
  Time busy = 0;                      // the longest time without a break; see find_busy
  const std::vector<Part>* all = nullptr;
  std::optional<Cause> cause;       // of the first that has no bound, if there is one
  Time limit = 0;                   // larger bounds are not of interest
  mutable std::uint64_t looks = 0;  // at sources, by demand(): what the analysis costs
  bool explains = false;            // answers have terms

  const Callback& at(std::size_t callback) const { return system.callbacks[callback]; }
  /// Whether the callback causes by itself what it sends there, in its executor.
  bool is_inside(std::size_t from, const Output& output) const {
    return !output.waits && at(from).executor == at(output.to).executor;
  }
  Count executions(std::size_t source, std::size_t callback) const;
  /// The longest execution of all.
  Time longest() const;
  /// What is done in a window wants at most: what arrives in it, or periods of logical execution
  /// time.
  Time demand(Time window) const { return demand(window, 0); }
  /// What its threads want, callbacks or not: with `more` at each execution.
  Time demand_with_spinning(Time window, Time more) const;
  /// The same if each execution takes so much more.
  Time demand(Time window, Time more) const;
  /// A number of arrivals of a source, each with this cost.
  Term term(std::size_t source, Count count, Time cost) const;
  /// Adds what the CPU does meanwhile for others, and what has passed before the arrival.
  void finish(std::vector<Term>& terms, Time bound, Time offset) const;
  /// Why its busy time has no end.
  Cause cause_of_overload() const;
  std::string why_overloaded() const;
  /// How long an execution that has begun keeps another one waiting: not all of it, unless
  /// something may arrive from another thread at the very instant at which it begins.
  Time blocking(Time execution) const;
  /// The arrivals at one callback itself: from outside, and inside the executor.
  struct Inner {
    ArrivalCurve curve;
    Count messages;
    friend auto operator<=>(const Inner&, const Inner&) = default;
  };
  std::vector<Inner> inner_arrivals(std::size_t callback) const;
  /// The most messages that wait for it or are served, when the spans are final: an arrival at a
  /// source is done with when its span has ended.
  Count backlog(std::size_t callback) const;

  /// The most that a snapshot contains: each callback once.
  Time snapshot() const;
  /// What of it is served up to the callback and with it.
  Time snapshot_until(std::size_t callback) const;
  /// When messages are sent, counted from the arrival: at the callback's end, or at that of a
  /// period of logical execution time.
  Time earliest_sent(const Span& span) const;
  Time latest_sent(const Span& span, std::size_t callback) const;
  /// How long after the bound of its end.
  Time sent_after(std::size_t callback) const;
  /// How long after an end, whenever that is.
  Time longest_held() const;
  /// Whether all callbacks together need no longer than a period.
  bool fits_into_period() const;
  /// How close to each other executions of one callback may send.
  Time least_distance_of_outputs() const;

 private:
  // After the end of a period, until its thread has a CPU. Unbounded if it may be busy yet.
  Time lateness() const;
};

/// The reason to give for messages whose delay is not known.
std::string why_delayed(const Callback& from, const Callback& to);

/// Most arrivals in a window, of all together.
Count most(const std::vector<Part::Inner>& arrivals, Time window);
/// The instants from `from` to below `limit` at which one of them has more.
std::vector<Time> steps(const std::vector<Part::Inner>& arrivals, Time limit, Time from = 0);

/// One arrival of a source, and the callbacks of the executor that run because of it, one after
/// the other.
struct Path {
  const Part& part;
  std::size_t source = 0;
  std::vector<std::size_t> callbacks;

  std::size_t last() const { return callbacks.back(); }
  /// Whether nothing but the source, and each callback for the next, makes these callbacks ready.
  bool is_alone() const;
};

/// From the earliest to the latest instant of something: unbounded if the latest is.
inline Time between(Time earliest, Time latest) noexcept {
  return latest >= kUnbounded ? kUnbounded : std::max(Time{0}, latest - earliest);
}

/// The result of a method.
struct Answer {
  // From the arrival to the end of the last callback, if the thread needs no time to wake up.
  Time bound = kUnbounded;
  std::string why_not;      // the first assumption that does not hold; empty: all do
  std::vector<Term> terms;  // if the part explains

  static Answer none(std::string why_not) { return {kUnbounded, std::move(why_not), {}}; }
};

/// The answer of a method that looks at one callback at a time: the response of the last callback
/// from its own arrival, after all that is known of the one before.
Answer with_what_precedes(const Path& path, Time response, std::vector<Term> terms = {});

/// One analysis. Registered with the macro below, in a file of its own.
/// Thread safety: const methods from any thread. Real-time: no.
class Method {
 public:
  virtual ~Method() = default;
  virtual Answer bound(const Path& path) const = 0;
};

struct MethodTraits {
  std::string assumes, source;  // for people
  /// Applies to every executor and order: if it finds no bound, that lies in the system.
  bool is_general = false;
  /// It is for logical execution time; the others are not.
  bool is_for_let = false;
  /// It is for callbacks that interrupt each other; the others are not.
  bool is_for_preemption = false;
};
using MethodRegistry = Registry<Method, MethodTraits>;
/// All methods of this process by name.
MethodRegistry& methods();

/// At namespace scope in a .cpp file. Behind the class stand the traits: `.assumes = "one thread"`.
#define TAKT_REGISTER_METHOD(name, description, Class, ...)                               \
  namespace {                                                                             \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_method_) =                                 \
      (::takt::analysis::methods().add(                                                   \
           name, {description, [] { return std::make_unique<Class>(); }, {__VA_ARGS__}}), \
       true);                                                                             \
  }

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_METHOD_HPP_
