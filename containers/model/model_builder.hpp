// The steps from nodes and threads to a SystemModel. Private to the model's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_
#define TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_

#include <algorithm>
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
#include "takt/containers/model/places.hpp"
#include "takt/containers/model/system_model.hpp"

namespace takt {

/// One executor of the model: of the file, or a child of one that isolates.
struct ModelledPart {
  const ModelledProcess* process;
  const ExecutorDescription* description;
  std::string scheduler;
  std::vector<std::size_t> callbacks;
};

/// Makes a SystemModel, step by step: an object for each.
/// Thread safety: none. Real-time: no.
class ModelBuilder {
 public:
  ModelBuilder(const SystemDescription& description, std::span<const PlannedChain> chains,
               std::span<const ModelledProcess> processes, const MeasuredModel* measured)
      : description_(description), chains_(chains), processes_(processes), measured_(measured) {
    if (measured == nullptr) return;
    for (const MeasuredCallback& callback : measured->callbacks) {
      measured_callbacks_[callback.name] = &callback;
    }
  }

  SystemModel build() {
    set_overheads();
    add_callbacks();
    add_unknown_callbacks();
    place_threads();
    for (std::size_t i = 0; i < callbacks_.size(); ++i) set_execution(i);
    link();
    cut_circles();
    for (std::size_t i = 0; i < callbacks_.size(); ++i) set_arrivals(i);
    choose_who_paces_joins();
    for (const ModelledPart& part : parts_) set_order(part);
    pass_on_what_is_unknown();
    add_chains();
    add_assumptions();
    return std::move(model_);
  }

 private:
  void set_overheads();
  void add_callbacks();
  void add_unknown_callbacks();
  std::size_t part_of(const ModelledProcess& process, const ModelledProcess::Callback& callback);
  void add_threads(const ModelledProcess& process, const ExecutorDescription& description,
                   const ModelledProcess::Callback& callback, const ExecutorTraits& traits);
  void place_threads();
  void set_execution(std::size_t callback);
  std::pair<double, double> speeds_of(std::size_t executor) const;
  void link();
  void link_publishers(std::size_t subscription);
  void link_callers(std::size_t service);
  void link_answers(std::size_t client);
  std::size_t answering(std::size_t service) const;
  /// How a message would go from one callback to another.
  struct Way {
    std::string topic;
    bool is_declared = false;  // that it does go
    bool joins = false;
  };
  void link(std::size_t from, std::size_t to, const Way& way);
  bool has_seen(std::size_t from, std::size_t to) const {
    const MeasuredCallback* const seen = measured(from);
    return seen != nullptr && seen->causes.contains(model_.system.callbacks[to].name);
  }
  void cut_circles();
  void set_arrivals(std::size_t callback);
  bool is_step(std::size_t from, std::size_t to) const;
  void refuse_execution_below(Nanoseconds known, std::size_t callback) const;
  std::optional<Nanoseconds> said_by_component(std::size_t callback) const;
  void add_waits(std::size_t callback);
  std::optional<ArrivalDescription> stated_arrival(std::size_t callback, bool has_senders) const;
  analysis::ArrivalCurve declared_arrivals(std::size_t callback, const ArrivalDescription& arrival,
                                           bool has_senders) const;
  std::optional<analysis::ArrivalCurve> arrivals_of(std::size_t callback, bool has_senders);
  std::optional<analysis::ArrivalCurve> measured_arrivals(const MeasuredCallback& seen) const;
  std::optional<analysis::ArrivalCurve> unexplained_arrivals(std::size_t callback) const;
  void choose_who_paces_joins();
  analysis::Time period_before(std::size_t callback) const;
  void set_order(const ModelledPart& part);
  void pass_on_what_is_unknown();
  void add_chains();
  void add_assumptions();
  void add_assumptions_of_machine();
  void add_assumptions_of_model();
  void add_what_nobody_says();
  void add_what_was_not_seen();
  const ModelledProcess* process_of(std::size_t callback) const {
    return parts_[model_.system.callbacks[callback].executor].process;
  }
  bool joins_dds() const { return description_.dds.has_value() || processes_.size() > 1; }
  const MeasuredCallback* measured(std::size_t callback) const {
    const auto found = measured_callbacks_.find(model_.system.callbacks[callback].name);
    return found != measured_callbacks_.end() ? found->second : nullptr;
  }
  const std::vector<int>& cpus() const {
    return description_.machine.cpus.empty() ? available_cpus() : description_.machine.cpus;
  }

  const SystemDescription& description_;
  const std::span<const PlannedChain> chains_;
  const std::span<const ModelledProcess> processes_;
  const MeasuredModel* const measured_;  // or nullptr
  std::map<std::string, const MeasuredCallback*, std::less<>> measured_callbacks_;

  SystemModel model_;
  std::vector<ModelledPart> parts_;  // as model_.system.executors
  std::map<std::tuple<const ModelledProcess*, std::string, const void*>, std::size_t> part_index_;
  std::vector<const ModelledProcess::Callback*> callbacks_;  // as model_.system.callbacks
  std::vector<ModelledThread> threads_;
  std::vector<Place> places_;
  std::set<std::size_t> in_circle_;  // callbacks
  std::vector<bool> may_run_;        // by callback
  // What the run of the measured model has not shown, and so counts as not happening.
  std::vector<std::string> not_seen_;
  // What else is taken for granted of single callbacks.
  std::vector<std::string> granted_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_MODEL_BUILDER_HPP_
