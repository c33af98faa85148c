// The model of a system for its analysis, from nodes, threads and files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_
#define TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_

#include <map>
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
    std::optional<CallbackParameters> changed = {};  // instead of the node's own
    /// On an `isolated` executor: the index of the callback's thread, and its attributes when it
    /// was made.
    struct Thread {
      std::size_t place = 0;
      ThreadAttributes attributes;
    };
    std::optional<Thread> thread = {};
    bool is_served = true;  // false: its group is for an executor that its component makes

    CallbackParameters parameters() const;
  };
  /// A node of the process, even if it has no callbacks yet.
  struct Member {
    std::shared_ptr<Node> node;
    std::vector<std::string> executors;  // of its groups
    SourceLine where;
    bool is_of_takt = false;  // its class comes with Takt
    // An exception ends the process; false: only the instance.
    bool ends_with_exceptions = true;
  };
  std::string name;
  std::vector<ExecutorDescription> executors;  // as they are made
  std::vector<std::string> notes;              // how they are not as the file says
  std::vector<ThreadAttributes> threads;       // by name, those of executors
  std::vector<Callback> callbacks;
  std::vector<Member> nodes;
  /// A program may do more than the file describes.
  bool is_program = false;
  /// Its nodes that the file does not name, and the topics, also of services, to which they send.
  using OtherNodes = std::map<std::string, std::set<std::string>>;
  OtherNodes others;
  std::size_t mode = 0;  // the place in SystemDescription::modes, from 1; 0: normal
};

/// What the caller knows of the machine that the system runs on, beside what the file states. A
/// fact that is empty is known by nobody: the model takes the worst, or assumes it.
struct MachineFacts {
  /// A real-time thread of another process, or one that a constructor has made.
  struct Thread {
    std::string name;
    int process = 0;           // 0: this one
    bool is_reserved = false;  // SCHED_DEADLINE
    int priority = 0;
    std::vector<int> cpus;
  };
  std::string name;  // as models say it
  std::optional<bool> is_virtual;
  std::vector<Thread> others;
  // As takt::realtime_grant() and so on have them.
  std::optional<RealtimeGrant> grant;
  std::optional<Nanoseconds> fair_server, tick, turn_of_round_robin;
  /// Number of samples by which the overheads of `machine:` were measured here; 0: they are of the
  /// file.
  std::size_t overhead_samples = 0;
};

/// What the kernel of this machine says by itself.
MachineFacts facts_of_kernel();

/// Where the execution time of a callback comes from.
enum class Provenance {
  declared,  // `execution:` in the file
  promised,  // `budget:`; a longer execution is counted, not prevented
  measured,  // in a model file, with its margin
  exact,     // stated by the component: its own work, without sending
  unknown,
};
std::string_view to_string(Provenance provenance) noexcept;

/// A system as the analyses see it, in nanoseconds, with facts for reports.
struct SystemModel {
  struct Callback {
    Provenance execution = Provenance::unknown;
    Nanoseconds waits{0};  // the part of the execution time that needs no CPU
    std::uint64_t measured_executions = 0;
    /// CPU times of the measured run, for comparison only; longest 0: none.
    MeasuredTimes seen;
    std::size_t depth = 0;      // of a subscription's queue; 0: none
    Nanoseconds period{0};      // of a timer
    std::uint64_t dropped = 0;  // in the measured run: messages, or releases of a timer
    std::optional<Nanoseconds> lifespan = {};  // of its messages
    /// The longest `delay` of its messages from other processes: deadlines count from their
    /// sending.
    Nanoseconds longest_way{0};
    std::size_t bytes = 0;    // of a message from another process, as its sender states
    std::string best_effort;  // why messages to it may be lost on their way; empty: they are not
    /// With `overrun: abort`: the chain instance ends if the callback takes longer.
    std::optional<Nanoseconds> given_up_after;
    analysis::Count other_receivers = 0;  // of its messages, after the first one of each
    bool merges = false;                  // all triggers before it begins are served at once
    bool skips = false;  // of a timer: skips releases before the earlier one has ended
    /// If the callback takes longer, a handler of the user runs, for an unknown time.
    std::optional<Nanoseconds> handled_after;
    /// A publisher with loans: it sends nothing when all loans are in use.
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
    Nanoseconds observed{0};   // the longest latency in the measured run; 0: not known
    Nanoseconds simulated{0};  // the longest latency in a simulation of this model; 0: none
    /// How many instances began in the measured run, and came through; 0: not known.
    std::uint64_t begun = 0, came_through = 0;
    double begun_a_second = 0;
    std::uint64_t runs = 1;   // that these figures are of, at most
    bool is_managed = false;  // its nodes have a lifecycle: it began before all were active
    bool allows_losses = false;
    /// How long messages to its first callback are in transit: an instance begins when its message
    /// is sent. kUnbounded: not known.
    analysis::Time delay = 0;
    std::vector<Assumption> assumptions;  // of its bound, each id once
    std::set<std::size_t> executors;      // that its bound depends on
    std::string why_not;                  // if it is not in the system
    bool is_dropped = false;              // this mode drops a callback: see why_not
    std::size_t index = 0;                // in system.chains, if why_not is empty
  };
  analysis::System system;
  std::vector<SourceLine> executors_at;  // the lines of system.executors
  std::vector<Callback> callbacks;       // indexed as system.callbacks
  std::vector<Chain> chains;             // of the file
  std::vector<Assumption> assumptions;   // of all chains
};

/// Overheads stated in the file take precedence, and what nobody says is 0. A wake-up includes a
/// context switch. This takes longer on a slow CPU: the slowest counts for all.
analysis::Overheads overheads_of(const MachineDescription& machine, const MeasuredModel* measured);

/// Builds the model of the processes of a description. Precedence of execution times: the file's,
/// its budgets, the measured ones, the component's. An executor with a callback of unknown
/// execution time has no bound, nor have executors that wait for it, and the model says why.
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
    /// The bound is for instances that come through. Why some may be lost; and at least one of so
    /// many comes through. 1: none is lost; 0: that is not known.
    std::string why_lossy;
    analysis::Count one_of = 1;
  };
  analysis::Bounds all;       // indexed as in the system
  std::vector<Chain> chains;  // as in SystemModel::chains
};

/// Analyses the model with analysis::analyze, within a limit that fits its deadlines and periods,
/// and adds what depends on the model: losses, and chains that have no bound.
ModelBounds analyze(const SystemModel& model);

/// The verdict on a chain, from its bound, its assumptions and its measured latencies.
enum class Verdict {
  unjudged,     // it has no deadline
  dropped,      // the mode drops one of its callbacks: no instances
  guaranteed,   // its bound is at most its deadline, all come through unless it allows losses, and
                // each assumption is checked or accepted
  bounded_if,   // as guaranteed, but for assumptions: see missing()
  not_shown,    // its bound exceeds the deadline; it may be in time
  not_covered,  // it depends on a fact that no number covers
  may_lose,     // in time, if it comes through
  no_bound,
  missed,  // a run has missed the deadline, or a simulation does
  // A latency exceeded the bound, or the system did what the file excludes.
  refuted,
};
std::string_view to_string(Verdict verdict) noexcept;
Verdict verdict(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// For people: "guaranteed (2 accepted)".
std::string describe(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// Why the measured run lost more instances than the bound allows for; empty: it did not.
std::string why_lost_in_run(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// The assumptions that keep a bound from being a guarantee: not checked or accepted, refuted, or
/// not covered.
std::vector<const Assumption*> missing(const SystemModel::Chain& chain,
                                       const ModelBounds::Chain& bound);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_SYSTEM_MODEL_HPP_
