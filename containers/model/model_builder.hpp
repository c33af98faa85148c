// The steps from nodes and threads to a SystemModel and its assumptions. Private to the model's
// files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_
#define TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "takt/base/available_cpus.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/model/model_topics.hpp"
#include "takt/containers/model/places.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/named_topics.hpp"

namespace takt {

/// One executor of the model: one of the file, or a child of an isolated executor.
struct ModelledPart {
  const ModelledProcess* process;
  const ExecutorDescription* description;
  std::string scheduler;
  std::vector<std::size_t> callbacks;
};

/// Rounded up; unbounded if it is longer than a bound can be.
inline analysis::Time whole_time(double nanoseconds) {
  if (!(nanoseconds < static_cast<double>(analysis::kUnbounded))) return analysis::kUnbounded;
  return static_cast<analysis::Time>(std::ceil(nanoseconds));
}

/// Whether nobody has stated the time to wake a thread, but a run has: with the change to it.
bool is_wake_measured(const MachineDescription& machine, const MeasuredModel* measured);

/// Whether the node is of a class of Takt's that declares everything its callbacks do.
inline bool says_all(const ModelledProcess::Member& member) {
  return member.is_of_takt &&
         dynamic_cast<const KnowsExecutionTimes*>(member.node.get()) != nullptr;
}

/// The parts of a model that have been built so far.
/// Thread safety: none. Real-time: no.
class ModelParts {
 public:
  ModelParts(const SystemDescription& description, std::span<const PlannedChain> chains,
             std::span<const ModelledProcess> processes, const MeasuredModel* measured,
             const MachineFacts& machine)
      : description_(description),
        chains_(chains),
        processes_(processes),
        measured_(measured),
        machine_(machine) {
    if (measured == nullptr) return;
    for (const MeasuredCallback& callback : measured->callbacks) {
      measured_callbacks_[callback.name] = &callback;
    }
  }

 protected:
  /// A fact that becomes part of an assumption.
  struct Fact {
    std::string id;
    Assumption::State state;
    std::string text;  // with {} for all `name` that share it
    std::string name;
    std::string source;
    std::optional<std::size_t> executor;  // whose bounds depend on it; nullopt: all executors
  };
  void assume(Fact fact) { facts_.push_back(std::move(fact)); }
  /// The state of an assumption that a BoundWatch can check.
  Assumption::State if_watched() const noexcept {
    return description_.watches_bounds ? Assumption::State::checked : Assumption::State::unchecked;
  }
  /// Adds an assumption about a callback, whose name replaces "{}" in the text.
  void assume_of(std::size_t callback, const char* id, std::string text,
                 std::string source = "nobody",
                 Assumption::State state = Assumption::State::unchecked);
  /// Assumes that `what` never happens, as the measured run has not shown it.
  void assume_unseen(const std::string& what, std::size_t callback);
  /// "declared at robot.yaml:7".
  static std::string declared_at(const SourceLine& where);
  /// The line of the first such key in the file; empty: there is none.
  SourceLine line_of(std::string_view map, std::string_view key) const;
  std::string measured_source() const;
  std::pair<double, double> speeds_of(std::size_t executor) const;
  std::optional<Nanoseconds> said_by_component(std::size_t callback) const;
  /// The messages that the callback sends, as its component states.
  std::optional<Sending> said_to_send(std::size_t callback) const;
  /// The same for the node of the callback.
  bool says_all(std::size_t callback) const;
  bool is_dropped(std::size_t callback) const {
    return callbacks_[callback]->parameters().serving == Serving::dropped;
  }
  std::string why_dropped(std::size_t callback) const;
  const ModelledProcess* process_of(std::size_t callback) const {
    return parts_[model_.system.callbacks[callback].executor].process;
  }
  /// The callbacks of other processes that send to this one.
  std::vector<std::size_t> senders_elsewhere(std::size_t callback) const;
  bool joins_dds() const { return description_.dds.has_value() || processes_.size() > 1; }
  /// Whether nothing from outside of the file can be received.
  bool is_closed() const {
    return !joins_dds() || (description_.dds && description_.dds->discovery == DiscoveryRange::off);
  }
  /// The arrivals from outside that the file states for the topic of the callback: `arrival`, or
  /// what a `period` promises. Throws Error if it states two that differ.
  struct StatedArrival {
    ArrivalDescription arrival;
    const char* key;
    SourceLine where;
  };
  std::optional<StatedArrival> stated_arrival(std::size_t callback) const;
  /// Whether messages come from outside, by the file or a run.
  bool comes_from_outside(std::size_t callback) const;
  /// What the run says of the callback alone. Of what comes to it: topics_.
  const MeasuredCallback* measured(std::size_t callback) const {
    const auto found = measured_callbacks_.find(model_.system.callbacks[callback].name);
    return found != measured_callbacks_.end() ? found->second : nullptr;
  }
  /// To real-time threads: as the file states, or else as here, which is an assumption.
  RealtimeGrant granted() const {
    const auto& stated = description_.machine.rt_runtime;
    if (stated) return {.runtime = *stated};
    return machine_.grant ? *machine_.grant : realtime_grant();
  }
  bool may_have_fair_server() const {
    return machine_.fair_server.value_or(Nanoseconds::max()) != Nanoseconds::zero();
  }
  const std::vector<int>& cpus() const {
    return description_.machine.cpus.empty() ? available_cpus() : description_.machine.cpus;
  }

  const SystemDescription& description_;
  const std::span<const PlannedChain> chains_;
  const std::span<const ModelledProcess> processes_;
  const MeasuredModel* const measured_;  // or nullptr
  const MachineFacts& machine_;
  std::map<std::string, const MeasuredCallback*, std::less<>> measured_callbacks_;

  SystemModel model_;
  std::vector<ModelledPart> parts_;  // indexed as model_.system.executors
  std::map<std::tuple<const ModelledProcess*, std::string, const void*>, std::size_t> part_index_;
  std::vector<const ModelledProcess::Callback*> callbacks_;  // indexed as model_.system.callbacks
  ModelTopics topics_;
  std::vector<ModelledThread> threads_;
  std::vector<Place> places_;
  std::set<std::size_t> in_circle_;                // callbacks
  std::map<std::size_t, analysis::Count> joined_;  // by join: the most messages at once in a run
  // Why messages of one callback do not reach another one, though they have a topic in common.
  std::map<std::pair<std::size_t, std::size_t>, std::string> nothing_passes_;
  std::vector<bool> may_run_;   // by callback
  bool finds_dropped_ = false;  // whether a callback that a mode drops was found
  std::vector<Fact> facts_;
};

/// The factor by which the callback takes longer than is known, see SystemDescription.
double execution_scale(const SystemDescription& description, const Node& node,
                       const std::string& callback);

/// A longer bound counts as none: it fits the deadlines and periods of the model.
analysis::Time longest_bound(const SystemModel& model);

/// Throws Error: this callback or chain of the model cannot be of the system.
[[noreturn]] void refuse_model(const MeasuredModel& model, const std::string& entry,
                               const std::string& what);

/// Finds the assumptions under which the measured run applies.
/// Thread safety: none. Real-time: no.
class MeasuredRun : public ModelParts {
 public:
  using ModelParts::ModelParts;

 protected:
  void compare_timers() const;
  void compare_number(std::size_t callback, const analysis::ArrivalCurve& promised,
                      const StatedArrival& stated);
  std::optional<std::uint64_t> explained(std::size_t callback) const;
  void add_assumptions_of_model();

 private:
  void add_what_was_measured(std::size_t callback);
  void find_executors_then();
  const MeasuredExecutor& executor_then(std::size_t callback) const { return *then_[callback]; }
  void add_new_neighbours();
  std::vector<bool> find_receivers_gone() const;
  void add_who_destroys();
  void add_how_it_sent(std::size_t callback);
  void add_other_processes(std::size_t callback);

  std::vector<const MeasuredExecutor*> then_;  // by callback; not known if it has no name
};

/// Finds the assumptions of a model.
/// Thread safety: none. Real-time: no.
class AssumptionFinder : public MeasuredRun {
 public:
  using MeasuredRun::MeasuredRun;

 protected:
  void add_assumptions();
  std::vector<std::optional<std::size_t>> parts_of(const ModelledProcess& process,
                                                   const ModelledProcess::Member& node) const;
  std::set<std::optional<std::size_t>> executors_of_maker(const std::string& callback) const;

 private:
  void add_keys_not_covered();
  void add_lifecycle_nodes();
  void add_reserved_threads();
  void add_reserved_thread(const ThreadAttributes& own, const std::string& key);
  void add_what_else_runs(std::size_t executor);
  void add_reservations(std::size_t executor);
  void add_threads_of_others(std::size_t executor);
  void add_assumptions_of_machine();
  void add_throttling();
  void add_cpus();
  void add_orders();
  void add_overheads();
  void add_overheads_of_taking(std::size_t callback);
  void add_overheads_of_sending(std::size_t callback);
  void assume_overhead(const char* what, const std::optional<Nanoseconds>& said,
                       Nanoseconds measured, std::optional<std::size_t> executor);
  void add_assumptions_of_start();
  void add_who_else_sends();
  void add_other_nodes(std::size_t receiver);
  void add_what_others_may_change();
  void add_nodes_that_may_rest();
  void add_switches_of_modes();
  void add_who_sends_besides();
  void add_exceptions();
  void add_what_nobody_says();
  void add_heap();
  void add_what_nobody_says_of_loans(std::size_t sender);
  void add_what_nodes_may_make();
  bool sends(std::size_t callback) const;
  bool gets_small_messages(std::size_t callback) const;
  /// The assumptions of these executors, one for each id and state; nullptr: of all.
  std::vector<Assumption> assumptions(const std::set<std::size_t>* executors) const;
  /// The executors that the bound of a chain depends on.
  std::set<std::size_t> executors_of(const std::vector<std::size_t>& path) const;
};

/// The chains of a model, and why they have no instances.
/// Thread safety: none. Real-time: no.
class ChainFinder : public AssumptionFinder {
 public:
  using AssumptionFinder::AssumptionFinder;

 protected:
  void add_chains();

 private:
  void compare_instances(const SystemModel::Chain& chain, std::size_t last) const;
  void count_begun(const std::vector<std::size_t>& path, SystemModel::Chain& chain) const;
  analysis::Time delay_before(std::size_t first);
  std::string why_nothing_comes(const std::vector<std::size_t>& path);
  std::string why_it_begins_before(std::size_t first);
  std::string why_it_never_joins(const std::vector<std::size_t>& path);
  std::string why_it_never_runs(std::size_t callback);
};

/// Makes a SystemModel, step by step. One object makes one model.
/// Thread safety: none. Real-time: no.
class ModelBuilder : public ChainFinder {
 public:
  using ChainFinder::ChainFinder;

  SystemModel build() {
    model_.system.overheads = overheads_of(description_.machine, measured_);
    add_callbacks();
    add_unknown_callbacks();
    compare_timers();
    place_threads();
    link();
    for (std::size_t i = 0; i < callbacks_.size(); ++i) {
      is_dropped(i) ? set_discarding(i) : set_execution(i);
    }
    add_publishers();
    cut_circles();
    topics_.find_senders(model_.system);
    for (std::size_t i = 0; i < callbacks_.size(); ++i) set_arrivals(i);
    forget_outputs_of_dropped();
    topics_.find_senders(model_.system);
    choose_who_paces_joins();
    for (const ModelledPart& part : parts_) set_order(part);
    pass_on_what_is_unknown();
    add_chains();
    add_assumptions();
    return std::move(model_);
  }

 private:
  void add_callbacks();
  void check_names() const;
  void add_unknown_callbacks();
  std::size_t part_of(const ModelledProcess& process, const ModelledProcess::Callback& callback);
  void add_threads(const ModelledProcess& process, const ExecutorDescription& description,
                   const ModelledProcess::Callback& callback, const ExecutorTraits& traits);
  void place_threads();
  void set_execution(std::size_t callback);
  void refute_budget(std::size_t callback, Nanoseconds known, std::string source);
  void set_discarding(std::size_t callback);
  void forget_outputs_of_dropped();
  void link();
  void link_publishers(std::size_t subscription);
  void link_unexplained();
  bool is_offered(const PublishingCallbacks& publishing, std::size_t from,
                  std::size_t subscription);
  void add_publishers();
  void add_publishers(const Node& node, const std::string& topic,
                      const std::vector<std::size_t>& callbacks,
                      const std::vector<std::size_t>& receivers,
                      std::vector<analysis::Count>& outputs);
  void link_callers(std::size_t service);
  void link_answers(std::size_t client);
  std::size_t answering(std::size_t service) const;
  /// A path of messages from one callback to another.
  struct Way {
    std::string topic;
    bool is_declared = false;  // the code declares that messages take it
    bool joins = false;
  };
  void link(std::size_t from, std::size_t to, const Way& way);
  void cut_circles();
  void set_arrivals(std::size_t callback);
  bool is_step(std::size_t from, std::size_t to) const;
  void compare_execution(Nanoseconds said, Nanoseconds seen, std::size_t callback);
  Nanoseconds sending(std::size_t callback);
  Nanoseconds taking(std::size_t callback);
  void add_waits(std::size_t callback);
  analysis::ArrivalCurve declared_arrivals(std::size_t callback, const StatedArrival& stated);
  void add_way_from_outside(std::size_t callback);
  void limit_depth(std::size_t callback);
  void compare_arrivals(std::size_t callback, const analysis::ArrivalCurve& promised,
                        const std::vector<Nanoseconds>& seen, const char* what);
  bool is_timeout(const Entity& entity) const;
  bool is_periodic(std::size_t callback) const;
  std::optional<analysis::ArrivalCurve> arrivals_of(std::size_t callback);
  std::optional<analysis::ArrivalCurve> measured_arrivals(const MeasuredCallback& seen) const;
  std::optional<analysis::ArrivalCurve> unexplained_arrivals(std::size_t callback) const;
  std::optional<analysis::ArrivalCurve> seen_arrivals(std::size_t callback) const;
  void choose_who_paces_joins();
  analysis::Time period_before(std::size_t callback) const;
  void set_order(const ModelledPart& part);
  void pass_on_what_is_unknown();
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_
