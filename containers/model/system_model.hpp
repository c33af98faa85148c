// From a system of nodes, threads and files to the numbers that its analysis needs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_
#define TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_

#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "takt/analysis/analysis.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/assumption.hpp"
#include "takt/containers/model/measured_model.hpp"
#include "takt/containers/planning/plan.hpp"

namespace TAKT_PUBLIC takt {

/// A container's description of its process, see Container::modelled.
struct ModelledProcess {
  struct Callback {
    std::shared_ptr<Node> node;
    std::shared_ptr<Entity> entity;
    std::string executor;                            // the name
    CallbackDescription described;                   // by the file
    std::optional<CallbackParameters> changed = {};  // instead of those that it has
    /// With `isolated`: the place of the thread that runs it, and the attributes it was made with.
    struct Thread {
      std::size_t place = 0;
      ThreadAttributes attributes;
    };
    std::optional<Thread> thread = {};
    bool is_served = true;  // false: its group is for an executor that its component makes

    CallbackParameters parameters() const;
  };
  /// Also one that has no callbacks yet.
  struct Member {
    std::shared_ptr<Node> node;
    std::vector<std::string> executors;  // of its groups
    SourceLine where;
    bool is_of_takt = false;           // its class is one that comes with Takt
    bool ends_with_exceptions = true;  // and its container; else an exception ends only an instance
  };
  std::string name;
  std::vector<ExecutorDescription> executors;  // as they are made
  std::vector<ThreadAttributes> threads;       // by name, those of executors
  std::vector<Callback> callbacks;
  std::vector<Member> nodes;
  /// A program that does more than the file says.
  bool is_program = false;
};

/// What the caller knows of the machine that the system runs on.
struct MachineFacts {
  /// A real-time thread of another process, or one that a constructor has made.
  struct Thread {
    std::string name;
    int process = 0;           // 0: this one
    bool is_reserved = false;  // SCHED_DEADLINE
    int priority = 0;
    std::vector<int> cpus;
  };
  bool is_known = false;  // it is this one, and the rest is true
  bool is_virtual = false;
  std::vector<Thread> others;
  Nanoseconds fair_server{0};  // see takt::fair_server()
  /// The overheads of `machine:` were measured here, by so many samples; 0: the file states them.
  std::size_t overhead_samples = 0;
};

/// Where the execution time of a callback comes from.
enum class Provenance {
  declared,  // `execution:` in the file
  promised,  // `budget:`; longer ones are counted, not prevented
  measured,  // in a model file, with its margin
  exact,     // the component says it: what it burns, without what sending costs
  unknown,
};
std::string_view to_string(Provenance provenance) noexcept;

/// A system as the analyses see it, in nanoseconds, and what people want to know of it.
struct SystemModel {
  struct Callback {
    Provenance execution = Provenance::unknown;
    Nanoseconds waits{0};  // of the execution, in which it needs no CPU
    std::uint64_t measured_executions = 0;
    /// CPU times of the measured run, of which no bound is made; longest 0: there are none.
    MeasuredTimes seen;
    std::size_t depth = 0;      // of a subscription's queue; 0: none
    Nanoseconds period{0};      // of a timer
    std::uint64_t dropped = 0;  // in the measured run: messages, or releases of a timer
    std::optional<Nanoseconds> lifespan = {};  // of its messages
    /// Of its messages, from another process: what counts from when they were sent has less left.
    Nanoseconds longest_way{0};
    std::size_t bytes = 0;    // of what it gets from another process, as its sender says
    std::string best_effort;  // why messages to it may be lost on their way; empty: they are not
    /// Its chain instance ends if it takes longer: `overrun: abort`.
    std::optional<Nanoseconds> given_up_after;
    analysis::Count other_receivers = 0;  // of what it sends at once, but for one of each message
    bool merges = false;                  // what triggers it before it begins is served at once
    bool skips = false;  // of a timer: a release that comes before the one before it has ended
    /// If it takes longer, a handler of its code runs, for a time that nobody knows.
    std::optional<Nanoseconds> handled_after;
    /// A publisher that lends its messages, and sends nothing when all are with somebody.
    struct Lending {
      std::string topic;
      analysis::Count loans = 0, in_use = 0;  // in_use: most that its senders have at a time
      std::vector<std::size_t> receivers;     // in its process
    };
    std::vector<Lending> lendings;
  };
  struct Chain {
    std::string name;
    Nanoseconds deadline{0};   // 0: none
    Nanoseconds observed{0};   // the longest that the measured model has seen; 0: not known
    Nanoseconds simulated{0};  // the longest in a simulation, of the times of this model; 0: none
    /// How many instances began in the measured run, and came through; 0: not known.
    std::uint64_t begun = 0, came_through = 0;
    double begun_a_second = 0;
    bool is_managed = false;  // by a life cycle: it began before all were active
    bool allows_losses = false;
    /// How long messages to its first callback are on their way: they are released when they are
    /// sent. kUnbounded: that is not known.
    analysis::Time delay = 0;
    std::vector<Assumption> assumptions;  // of its bound, each id once
    std::set<std::size_t> executors;      // on whose numbers it depends
    std::string why_not;                  // if it is not in the system
    bool is_dropped = false;              // in this mode it has no instances: see why_not
    std::size_t index = 0;                // in system.chains, else
  };
  analysis::System system;
  std::vector<SourceLine> executors_at;  // the lines of the system's
  std::vector<Callback> callbacks;       // as in the system
  std::vector<Chain> chains;             // of the file
  std::vector<Assumption> assumptions;   // of all chains
};

/// What the file says comes first. A thread that wakes has been switched to, too.
analysis::Overheads overheads_of(const MachineDescription& machine, const MeasuredModel* measured);

/// Builds the model of the processes of a description. Execution times, in this order: the file's,
/// its budgets, the measured ones, the component's. An executor that runs something
/// of unknown length, and all that wait for it, have no bound, and the model says why.
/// Thread safety: from any thread. Real-time: no.
SystemModel make_system_model(const SystemDescription& description,
                              std::span<const PlannedChain> chains,
                              std::span<const ModelledProcess> processes,
                              const MeasuredModel* measured = nullptr,
                              const MachineFacts& machine = {});

/// Bounds of the chains that have one, and the reasons of the others.
struct ModelBounds {
  struct Chain {
    std::optional<Nanoseconds> bound;
    std::string why_not;
    /// The bound is of the instances that come through. What may be lost, and how many: of so many
    /// one comes through at least; 1: none is lost; 0: that is not known.
    std::string why_lossy;
    analysis::Count one_of = 1;
  };
  analysis::Bounds all;       // as in the system
  std::vector<Chain> chains;  // as in SystemModel::chains
};

/// Analyses the model: analysis::analyze, with a limit that fits its deadlines and periods; and
/// what only the model knows: a chain has no bound if a queue on it may overflow.
ModelBounds analyze(const SystemModel& model);

/// The result for a chain, from its bound, what it rests on, and the latencies that were measured.
enum class Verdict {
  unjudged,     // it has no deadline
  dropped,      // in a mode that drops one of its callbacks: it has no instances
  guaranteed,   // its bound is at most its deadline, all come through unless it allows losses, and
                // each assumption is checked or accepted
  bounded_if,   // the same, but for these: see missing()
  not_shown,    // its bound is larger; it may be in time
  not_covered,  // there is something of which no number tells
  may_lose,     // in time, if it comes through
  no_bound,
  missed,   // a run has missed the deadline, or a simulation does
  refuted,  // one took longer than the bound, or did what the file says does not happen
};
std::string_view to_string(Verdict verdict) noexcept;
Verdict verdict(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// For people: "guaranteed (2 accepted)".
std::string describe(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// Fewer instances came through in the measured run than the bound covers; empty: not so.
std::string why_lost_in_run(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// The assumptions that keep a bound from being a guarantee: what nobody checks or accepts, and
/// what is refuted or not covered.
std::vector<const Assumption*> missing(const SystemModel::Chain& chain,
                                       const ModelBounds::Chain& bound);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_
