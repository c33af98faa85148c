// The assumptions of a model.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {
namespace {

using State = Assumption::State;

// Limit: lines of a file that an assumption names. At it: the first are named. Seen: "…".
constexpr std::size_t kMostSources = 3;

/// Whether the run has shown most of a timer's releases: it was neither cancelled nor reset.
bool has_kept_its_period(const MeasuredModel& run, const MeasuredCallback& seen,
                         Nanoseconds period) {
  const auto releases = static_cast<double>(seen.executions + seen.dropped + 1);
  return period != Nanoseconds::zero() &&
         releases * std::chrono::duration<double>(period) >=
             0.9 * std::chrono::duration<double>(std::max(run.duration, run.total_duration));
}

std::vector<std::string> once(std::vector<std::string> parts) {
  std::vector<std::string> result;
  for (std::string& part : parts) {
    if (std::find(result.begin(), result.end(), part) == result.end()) {
      result.push_back(std::move(part));
    }
  }
  return result;
}

std::string joined(std::vector<std::string> parts, std::string_view separator) {
  return fmt::format("{}", fmt::join(once(std::move(parts)), separator));
}

}  // namespace

// ---- Facts and assumptions ----

std::string ModelParts::declared_at(const SourceLine& where) {
  return where.empty() ? "declared" : "declared at " + where;
}

SourceLine ModelParts::line_of(std::string_view map, std::string_view key) const {
  for (const WrittenKey& written : description_.keys) {
    if (written.map == map && written.key == key) return written.where;
  }
  return {};
}

std::string ModelParts::measured_source() const {
  std::uint64_t least = 0;
  for (const MeasuredCallback& seen : measured_->callbacks) {
    if (seen.executions != 0 && (least == 0 || seen.executions < least)) least = seen.executions;
  }
  if (least == 0) return "stated in the model";  // a person has written the model
  return fmt::format("measured, n = {} or more", least);
}

bool ModelParts::says_all(std::size_t callback) const {
  const auto& nodes = process_of(callback)->nodes;
  return std::any_of(nodes.begin(), nodes.end(), [&](const ModelledProcess::Member& member) {
    return member.node == callbacks_[callback]->node && takt::says_all(member);
  });
}

void ModelParts::assume_of(std::size_t callback, const char* id, std::string text,
                           std::string source, Assumption::State state) {
  assume({.id = id,
          .state = state,
          .text = std::move(text),
          .name = "'" + model_.system.callbacks[callback].name + "'",
          .source = std::move(source),
          .executor = model_.system.callbacks[callback].executor});
}

void ModelParts::assume_unseen(const std::string& what, std::size_t callback) {
  const std::string length =
      measured_->duration == Nanoseconds::zero()
          ? "the measured run, of unknown length,"
          : fmt::format("the measured run of {:.3g} s",
                        std::chrono::duration<double>(measured_->duration).count());
  assume({.id = "not_seen",
          .state = State::unchecked,
          .text = fmt::format("it never happens that {}: {} has not shown it", what, length),
          .name = {},
          .source = measured_source(),
          .executor = model_.system.callbacks[callback].executor});
}

std::vector<Assumption> AssumptionFinder::assumptions(
    const std::set<std::size_t>* executors) const {
  struct Parts {
    std::string id;
    State state;
    // Each sentence, with all names that it applies to.
    std::vector<std::pair<std::string, std::vector<std::string>>> sentences;
    std::vector<std::string> sources;
  };
  std::vector<Parts> all;
  for (const Fact& fact : facts_) {
    if (executors != nullptr && fact.executor && !executors->contains(*fact.executor)) continue;
    auto known = std::find_if(all.begin(), all.end(), [&](const Parts& other) {
      return other.id == fact.id && other.state == fact.state;
    });
    if (known == all.end()) known = all.insert(known, {fact.id, fact.state, {}, {}});
    Parts& parts = *known;
    auto sentence = std::find_if(parts.sentences.begin(), parts.sentences.end(),
                                 [&](const auto& other) { return other.first == fact.text; });
    if (sentence == parts.sentences.end())
      sentence = parts.sentences.insert(sentence, {fact.text, {}});
    if (!fact.name.empty()) sentence->second.push_back(fact.name);
    parts.sources.push_back(fact.source);
  }
  std::vector<Assumption> result;
  for (Parts& parts : all) {
    std::vector<std::string> texts;
    for (auto& [text, names] : parts.sentences) {
      std::string whole = text;  // not fmt: names may contain braces
      if (const std::size_t place = whole.find("{}"); !names.empty() && place != whole.npos) {
        whole.replace(place, 2, joined(std::move(names), ", "));
      }
      texts.push_back(std::move(whole));
    }
    std::vector<std::string> sources = once(std::move(parts.sources));
    if (sources.size() > kMostSources) {
      sources.resize(kMostSources);
      sources.emplace_back("…");
    }
    result.push_back({.id = parts.id,
                      .text = joined(std::move(texts), "; "),
                      .source = joined(std::move(sources), ", "),
                      .state = parts.state,
                      .accepted = {}});
  }
  return result;
}

void AssumptionFinder::add_assumptions() {
  add_keys_not_covered();
  add_lifecycle_nodes();
  add_reserved_threads();
  add_assumptions_of_machine();
  add_overheads();
  add_orders();
  add_assumptions_of_model();
  add_assumptions_of_start();
  add_who_else_sends();
  add_who_sends_besides();
  add_exceptions();
  add_what_nobody_says();
  add_heap();
  add_what_nodes_may_make();
  const auto accept = [](std::vector<Assumption>& all, const Acceptances& reasons) {
    for (Assumption& assumption : all) {
      if (assumption.state != State::unchecked) continue;
      for (const auto& [key, reason] : reasons) {
        const auto [id, sentences] = split_accepted(key);
        if (id != assumption.id) continue;
        if (sentences.empty() || sentences == digest_of(assumption)) {
          assumption.accepted = reason;
        } else {
          assumption.source += fmt::format(", and `{}` accepts other sentences", key);
        }
      }
    }
  };
  model_.assumptions = assumptions(nullptr);
  accept(model_.assumptions, description_.accepted);
  for (SystemModel::Chain& chain : model_.chains) {
    if (chain.why_not.empty()) {
      chain.executors = executors_of(model_.system.chains[chain.index].callbacks);
      chain.assumptions = assumptions(&chain.executors);
    } else {
      chain.assumptions = assumptions(nullptr);
    }
    accept(chain.assumptions, description_.accepted);
    for (const ChainDescription& stated : description_.chains) {
      if (stated.options.name != chain.name) continue;
      accept(chain.assumptions, stated.accepted);
      if (!stated.from_activation) continue;
      std::erase_if(chain.assumptions,
                    [](const Assumption& each) { return each.id == "start_is_over"; });
    }
  }
}

// ---- What the system does ----

// A transient-local topic delivers its kept messages at once, and a constructor may send anything.
void AssumptionFinder::add_assumptions_of_start() {
  const auto add = [&](std::string text, std::size_t callback) {
    assume_of(callback, "start_is_over", std::move(text));
  };
  for (std::size_t to = 0; to < callbacks_.size(); ++to) {
    if (callbacks_[to]->entity->kind() == EntityKind::timer && !says_all(to)) {
      add("a first release of {} that its constructor chooses is served", to);
    }
    const auto* const end = dynamic_cast<const SubscriptionBase*>(callbacks_[to]->entity.get());
    if (end == nullptr) continue;
    if (dynamic_cast<const LifecycleNode*>(callbacks_[to]->node.get()) != nullptr) {
      add("what waits for {} until its node is active is served", to);
    }
    if (end->qos().durability == Durability::transient_local) {
      add("what {} gets at once when it is made, as its topic keeps it, is served", to);
    }
    const std::string topic = callbacks_[to]->entity->topic();
    for (const ModelledProcess& process : processes_) {
      for (const ModelledProcess::Member& member : process.nodes) {
        if (takt::says_all(member) || !member.node->publishing_callbacks(topic)) continue;
        add("what constructors and bring-up send to {} is served", to);
      }
    }
  }
}

void AssumptionFinder::add_who_else_sends() {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    for (const analysis::Output& output : model_.system.callbacks[i].outputs) {
      if (process_of(output.to) == process_of(i)) continue;
      assume_of(i, "dds_threads_elsewhere",
                "{} waits for no lock that threads of DDS hold, and no receiver that is slow to "
                "acknowledge, when it sends; its publishers keep (`depth`) all that readers have "
                "not acknowledged yet");
    }
  }
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const EntityKind kind = callbacks_[i]->entity->kind();
    const bool receives = kind == EntityKind::subscription || kind == EntityKind::service ||
                          kind == EntityKind::client;
    if (is_closed() && !process_of(i)->is_program) continue;
    assume_of(i, "no_other_publishers",
              receives && topics_.of(i).states_arrival != nullptr
                  ? "nothing comes to {} from outside of the file but what its `arrival` says"
              : receives ? "nobody outside of the file sends to {}"
                         : "nobody outside of the file receives what {} sends, which takes time");
    if (receives) add_other_nodes(i);
    // In a container, the threads `requests` serve these requests.
    if (process_of(i)->is_program)
      assume_of(i, "no_other_publishers", "nobody asks the parameter services of the node of {}");
  }
  if (!is_closed()) add_what_others_may_change();
  add_nodes_that_may_rest();
  if (!description_.modes.empty()) add_switches_of_modes();
}

// A container refuses requests that would break a guarantee that it knows of: only for chains of
// its own process, and by the model that its file names. It does not refuse to unload components or
// to change the state of a node.
void AssumptionFinder::add_what_others_may_change() {
  const bool may_restart = std::any_of(
      description_.restarts.begin(), description_.restarts.end(),
      [](const auto& each) { return each.second.policy != RestartOptions::Policy::never; });
  if (processes_.size() > 1) {
    assume({.id = "nothing_is_changed",
            .state = State::unchecked,
            .text = may_restart
                        ? "no process ends, or starts again (`restart`) and sends what it does at "
                          "its start"
                        : "no process ends before the others, by an exception (`on_exception`), a "
                          "signal or a crash",
            .name = {},
            .source = may_restart ? declared_at(line_of("a container", "restart")) : "nobody",
            .executor = {}});
  }
  const bool is_known =
      processes_.size() == 1 && (measured_ == nullptr || measured_->path == description_.model);
  assume(
      {.id = "nothing_is_changed",
       .state = if_watched(),
       .text = is_known
                   ? "no container unloads a component of a chain, or one that sends to a join of "
                     "it, and no node gets simulated time (`use_sim_time`)"
                   : "no container gets or unloads a component, no callback gets other "
                     "parameters, and no node gets simulated time (`use_sim_time`)",
       .name = {},
       .source = "nobody",
       .executor = {}});
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (!comes_from_outside(i) && senders_elsewhere(i).empty()) continue;
    assume_of(i, "nothing_is_changed",
              "nobody sets the wall clock, by which other processes say when they have sent what "
              "comes to {}");
  }
}

// A node that becomes active again gets the messages that have waited for it.
void AssumptionFinder::add_nodes_that_may_rest() {
  const auto& lifecycle = description_.lifecycle;
  using OnLoss = LifecycleDescription::OnLoss;
  const bool has_dependents =
      lifecycle && std::any_of(lifecycle->bring_up.begin(), lifecycle->bring_up.end(),
                               [](const auto& managed) { return !managed.depends_on.empty(); });
  const bool may_be_lost =
      lifecycle && (lifecycle->on_loss == OnLoss::shutdown ||
                    (lifecycle->on_loss == OnLoss::deactivate_dependents && has_dependents));
  if (is_closed() && !may_be_lost) return;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (dynamic_cast<const LifecycleNode*>(callbacks_[i]->node.get()) == nullptr) continue;
    assume_of(i, "nothing_is_changed",
              may_be_lost
                  ? "the node of {} stays active: no node that `lifecycle` manages misses its "
                    "`heartbeat`"
                  : "the node of {} stays active");
  }
}

// Threads of a component may publish at any time, and the code may declare `published_by` wrongly.
void AssumptionFinder::add_who_sends_besides() {
  for (std::size_t to = 0; to < callbacks_.size(); ++to) {
    if (callbacks_[to]->entity->kind() != EntityKind::subscription) continue;
    for (const ModelledProcess& process : processes_) {
      // What a thread sends would have been seen in its own process, with no cause: as_measured.
      const auto& receivers = topics_.of(to).receivers;
      const bool was_seen =
          std::any_of(receivers.begin(), receivers.end(), [&](std::size_t receiver) {
            const MeasuredCallback* const seen = measured(receiver);
            return process_of(receiver) == &process && seen != nullptr && seen->executions != 0;
          });
      if (was_seen) continue;
      for (const ModelledProcess::Member& member : process.nodes) {
        if (takt::says_all(member)) continue;
        const auto publishing = member.node->publishing_callbacks(callbacks_[to]->entity->topic());
        if (!publishing) continue;
        const std::string who = publishing->names.empty()
                                    ? std::string("callbacks")
                                    : fmt::format("'{}'", fmt::join(publishing->names, "', '"));
        assume_of(
            to, "as_declared",
            fmt::format("only {} of '{}' send to {{}}, and no thread that it has made: no run "
                        "has shown it",
                        who, member.node->fully_qualified_name()));
      }
    }
  }
}

// With such an `on_exception`, the container continues but the chain instance ends.
void AssumptionFinder::add_exceptions() {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const auto& nodes = process_of(i)->nodes;
    const auto member = std::find_if(nodes.begin(), nodes.end(), [&](const auto& other) {
      return other.node == callbacks_[i]->node;
    });
    if (member == nodes.end() || member->ends_with_exceptions) continue;
    assume_of(i, "as_declared",
              "no execution of {} ends with an exception: its `on_exception` lets the rest go on");
  }
}

// For each callback: properties that neither the file, a run nor its component states.
void AssumptionFinder::add_what_nobody_says() {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const Provenance execution = model_.callbacks[i].execution;
    if (!may_run_[i] || execution == Provenance::unknown) continue;
    const CallbackDescription& stated = callbacks_[i]->described;
    const MeasuredCallback* const seen = measured(i);
    const bool has_run = seen != nullptr && seen->executions != 0;
    const bool is_said = said_by_component(i).has_value();
    const auto add = [&](const char* text, std::string source, State state = State::unchecked) {
      assume_of(i, "as_declared", text, std::move(source), state);
    };
    if (execution == Provenance::declared && !has_run) {
      add("no execution of {} is longer than declared: no run has measured it",
          declared_at(stated.where), if_watched());
    }
    if (stated.execution && stated.execution->least != Nanoseconds::zero()) {
      const bool is_refuted = has_run && seen->least_execution != Nanoseconds::zero() &&
                              seen->least_execution < stated.execution->least;
      add(is_refuted ? "{} took less time in the measured run than its `execution` has as `min`"
                     : "no execution of {} is shorter than declared",
          declared_at(stated.where), is_refuted ? State::refuted : State::unchecked);
    }
    if (execution == Provenance::promised && !has_run) {
      add("no execution of {} is longer than its budget: no run has measured it",
          declared_at(stated.where), if_watched());
    }
    if (execution == Provenance::exact && !has_run && !says_all(i)) {
      add("no execution of {} is longer than its component says: no run has measured it", "nobody",
          if_watched());
    }
    add_what_nobody_says_of_loans(i);
    if (says_all(i) && is_said) continue;
    if (!is_said && !stated.waits && !(has_run && seen->longest_wait)) {
      add("no execution of {} waits for a lock (the heap's, too), a device, a reply or the like: "
          "nobody has declared (`waits`) or measured how long",
          "nobody");
    }
    const bool sends_at_end =
        stated.publishes_at_end && model_.system.callbacks[i].least_execution != 0;
    if (sends_at_end && !model_.system.callbacks[i].outputs.empty()) {
      add("{} sends at its end, and not before (`outputs`)", "nobody");
    }
    if (model_.system.callbacks[i].is_timer &&
        !(has_run && has_kept_its_period(*measured_, *seen, callbacks_[i]->entity->period()))) {
      add("{} keeps its period: no run has shown it", "nobody", if_watched());
    }
    const auto& outputs = model_.system.callbacks[i].outputs;
    const bool are_seen = std::all_of(outputs.begin(), outputs.end(), [&](const auto& output) {
      // A trace does not tell who has sent what comes from another process.
      return process_of(output.to) == process_of(i) &&
             (topics_.at_once(i, output.to) || measured(output.to) != nullptr);
    });
    if (outputs.empty() || (has_run && are_seen)) continue;
    add(callbacks_[i]->entity->kind() == EntityKind::service
            ? "each execution of {} answers its request: no run has shown it"
            : "each execution of {} sends one message to each topic and service, no more and no "
              "less: no run has shown it",
        "nobody");
  }
}

// A thread that holds the heap's lock inherits no priority. DDS threads use the heap, too.
void AssumptionFinder::add_heap() {
  const auto uses_heap = [](const ModelledProcess::Member& member) {
    const auto* const component = dynamic_cast<const KnowsExecutionTimes*>(member.node.get());
    return component == nullptr || component->uses_heap();
  };
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const auto& nodes = process_of(i)->nodes;
    const bool is_alone =
        !joins_dds() && std::all_of(parts_.begin(), parts_.end(), [&](const ModelledPart& part) {
          return part.process != process_of(i) ||
                 &part == &parts_[model_.system.callbacks[i].executor];
        });
    if (is_alone || !says_all(i) || std::none_of(nodes.begin(), nodes.end(), uses_heap)) continue;
    assume_of(i, "as_declared",
              "no execution of {} waits for the heap's lock, which a less urgent thread may hold");
  }
}

// A publisher has few loans, and a receiver may keep one for any time.
void AssumptionFinder::add_what_nobody_says_of_loans(std::size_t from) {
  const auto add = [&](std::size_t callback) {
    if (says_all(callback)) return;
    assume_of(callback, "as_declared",
              "{} keeps no message beyond its execution, of the few that a publisher lends");
  };
  for (const auto& lending : model_.callbacks[from].lendings) {
    add(from);
    for (const std::size_t receiver : lending.receivers) add(receiver);
  }
}

// A callback or a thread of a component may make another callback or publisher while the system
// runs, and a component may have another node, which nobody knows.
void AssumptionFinder::add_what_nodes_may_make() {
  for (const ModelledProcess& process : processes_) {
    for (const ModelledProcess::Member& member : process.nodes) {
      if (takt::says_all(member)) continue;
      const std::string name = member.node->fully_qualified_name();
      const bool has_run =
          measured_ != nullptr &&
          std::any_of(measured_->callbacks.begin(), measured_->callbacks.end(),
                      [&](const MeasuredCallback& seen) {
                        return seen.executions != 0 && seen.name.starts_with(name + "/");
                      });
      const auto add = [&](const char* text, std::optional<std::size_t> executor) {
        assume({.id = has_run ? "as_measured" : "as_declared",
                .state = State::unchecked,
                .text = text,
                .name = "'" + name + "'",
                .source = has_run ? measured_source() : "nobody",
                .executor = executor});
      };
      add("{} makes no publisher later, and has no other node: what that sends may come to any "
          "callback",
          {});
      add("{} starts no process (`fork`, `system`), after which threads wait for copies of their "
          "pages, also of locked ones",
          {});
      add("{} handles no signals: a handler runs on any thread, before its callback goes on", {});
      for (const auto& part : parts_of(process, member)) {
        add("{} makes no other callbacks later", part);
        assume({.id = "nothing_is_changed",
                .state = if_watched(),
                .text = "{} lets none of its callbacks go, and changes no parameters of them",
                .name = "'" + name + "'",
                .source = "nobody",
                .executor = part});
      }
    }
  }
}

}  // namespace takt
