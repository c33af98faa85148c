// SPDX-License-Identifier: Apache-2.0
#include "analyze/analyzed_file.hpp"

#include <algorithm>
#include <chrono>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "takt/base/available_cpus.hpp"
#include "takt/containers/modes.hpp"
#include "takt/measuring/machine.hpp"

#include "analyze/overheads.hpp"
#include "catalogue/catalogue.hpp"
#include "model/extraction.hpp"
#include "run/constructor_exit.hpp"
#include "table.hpp"

namespace takt::tools {

bool AnalyzedFile::is_all_guaranteed() const {
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    if (verdict(model.chains[i], bounds.chains[i]) != Verdict::guaranteed) return false;
    for (const Mode& mode : modes) {
      const Verdict found = verdict(mode.model.chains[i], mode.bounds.chains[i]);
      if (found != Verdict::guaranteed && found != Verdict::dropped) return false;
    }
  }
  return !model.chains.empty();
}

bool AnalyzedFile::is_contradicted() const {
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const Verdict found = verdict(model.chains[i], bounds.chains[i]);
    if (found == Verdict::missed || found == Verdict::refuted) return true;
  }
  return false;
}

const MeasuredChain* AnalyzedFile::observed(const SystemModel::Chain& chain) const {
  if (!measured) return nullptr;
  const auto found = std::find_if(measured->chains.begin(), measured->chains.end(),
                                  [&](const auto& other) { return other.name == chain.name; });
  return found != measured->chains.end() ? &*found : nullptr;
}

namespace {

/// An executor's type and scheduler: "events with fifo".
std::string kind_of(const std::string& type, const std::string& scheduler) {
  return fmt::format("{} with {}", type,
                     scheduler.empty() ? executors().traits(type).scheduler : scheduler);
}

/// As kind_of, where it runs each callback in the file.
std::map<std::string, std::string> kinds_in(const AnalyzedFile& file) {
  std::map<std::string, std::string> result;
  for (const ModelledProcess& process : file.processes) {
    std::map<std::string, std::string> executors;
    for (const ExecutorDescription& executor : process.executors) {
      executors[executor.name] = kind_of(executor.type, executor.scheduler);
    }
    for (const auto& callback : process.callbacks) {
      result[to_string(Chain::Step{callback.node, callback.entity->name()})] =
          executors[callback.executor];
    }
  }
  return result;
}

/// What differs between the run of the model and the file; empty: nothing that the model says.
std::string why_latencies_differ(const AnalyzedFile& file, const ContainerOverrides& overrides) {
  const MeasuredModel& model = *file.measured;
  if (model.executors.empty() && !(overrides.executor.empty() && overrides.scheduler.empty())) {
    return "they are of the executors of the file";
  }
  const auto kinds = kinds_in(file);
  for (const MeasuredExecutor& executor : model.executors) {
    const std::string measured = executor.type + " with " + executor.scheduler;
    for (const std::string& callback : executor.callbacks) {
      const auto here = kinds.find(callback);
      if (here == kinds.end() || here->second == measured) continue;
      return fmt::format("'{}' ran on {} then, and runs on {} here", callback, measured,
                         here->second);
    }
  }
  return {};
}

/// What a model of a run says of it; what one leaves out may have been otherwise.
struct Saying {
  const char* what;
  bool (*is_said)(const MeasuredModel&, const AnalyzedFile&);
};
constexpr Saying kSayings[] = {
    {"on which machine",
     [](const MeasuredModel& model, const AnalyzedFile&) { return !model.machine.empty(); }},
    {"how long the run was",
     [](const MeasuredModel& model, const AnalyzedFile&) {
       return model.duration != Nanoseconds::zero();
     }},
    {"on which executors",
     [](const MeasuredModel& model, const AnalyzedFile&) { return !model.executors.empty(); }},
    {"of which builds",
     [](const MeasuredModel& model, const AnalyzedFile& file) {
       return !model.components.empty() || file.program != nullptr;
     }},
};

/// In what the model is of another machine or of other components; empty: in nothing.
std::string why_it_is_from_elsewhere(const MeasuredModel& model, const AnalyzedFile& file) {
  std::vector<std::string> differences;
  const std::string here = rt::lasting_part(file.machine.name);
  for (const auto& [what, is_said] : kSayings) {
    if (is_said(model, file)) continue;
    differences.push_back(fmt::format("the model does not say {}", what));
  }
  if (!model.machine.empty() && file.machine.name.empty()) {
    differences.push_back(fmt::format("it is of '{}', and `machine: cpus` names another one",
                                      rt::lasting_part(model.machine)));
  } else if (!model.machine.empty() && rt::lasting_part(model.machine) != here) {
    differences.push_back(
        fmt::format("it is of '{}', and this is '{}'", rt::lasting_part(model.machine), here));
  }
  const auto settings = measured_settings(file.system);
  const auto add_others = [&](const auto& some, const auto& others, const char* when) {
    for (const auto& [key, value] : some) {
      const auto other = others.find(key);
      if (other != others.end() && other->second == value) continue;
      differences.push_back(fmt::format("`{}: {}` was {}", key, value, when));
    }
  };
  add_others(settings, model.settings, "not set in the measured run");
  add_others(model.settings, settings, "set in the measured run");
  if (model.components.empty()) return fmt::format("{}", fmt::join(differences, "; "));
  const std::vector<MeasuredComponent> now = components_of(file.system);
  if (now.size() != file.system.components.size()) {
    differences.emplace_back("a library cannot be read");
  }
  for (const MeasuredComponent& component : now) {
    const auto seen =
        std::find_if(model.components.begin(), model.components.end(),
                     [&](const MeasuredComponent& other) { return other.node == component.node; });
    if (seen == model.components.end()) {
      differences.push_back(fmt::format("'{}' was not in the measured run", component.node));
    } else if (seen->digest != component.digest) {
      differences.push_back(
          fmt::format("'{}' had another library, class, log level or parameters", component.node));
    }
  }
  return fmt::format("{}", fmt::join(differences, "; "));
}

/// Linux shows 15 characters of a name.
bool is_named(const SystemDescription& system, const rt::Neighbour& thread) {
  return std::any_of(system.threads.begin(), system.threads.end(),
                     [&](const ThreadDescription& named) {
                       return named.attributes.name.substr(0, 15) == thread.name;
                     });
}

auto fact_of(const rt::Neighbour& thread) {
  return MachineFacts::Thread{.name = thread.name,
                              .process = thread.process == getpid() ? 0 : thread.process,
                              .is_reserved = thread.policy == "SCHED_DEADLINE",
                              .priority = thread.priority,
                              .cpus = thread.affinity};
}

/// This machine, or what is given of it, if the system is for its CPUs.
MachineFacts facts_of_machine(SystemDescription& system, const std::optional<MachineFacts>& given) {
  for (const int cpu : system.machine.cpus) {
    const auto& here = usable_cpus();
    if (std::find(here.begin(), here.end(), cpu) != here.end()) continue;
    system.notes.push_back(fmt::format("CPU {} is not here: it is another machine", cpu));
    return {};
  }
  if (given) return *given;
  MachineFacts facts = facts_of_kernel();
  facts.name = rt::machine_line();
  facts.is_virtual = rt::is_virtual();
  for (const rt::Neighbour& other : rt::realtime_neighbours()) {
    facts.others.push_back(fact_of(other));
  }
  return facts;
}

/// Threads that constructors have made: the file does not name them.
void add_threads_of_components(AnalyzedFile& file) {
  for (const rt::Neighbour& own : rt::own_realtime_threads()) {
    if (!is_named(file.system, own)) file.machine.others.push_back(fact_of(own));
  }
}

/// Marks what the model does not fit.
void compare_with_model(AnalyzedFile& file, const ContainerOverrides& overrides) {
  MeasuredModel& model = *file.measured;
  const auto name = [](std::string path) {
    path.resize(std::min(path.find(" -- "), path.size()));  // and its program
    return path.substr(path.rfind('/') + 1);
  };
  if (!model.file.empty() && name(model.file) != name(file.system.file)) {
    file.system.notes.push_back(fmt::format("the model was measured with '{}', not with '{}'",
                                            model.file, file.system.file));
  }
  model.differs = why_it_is_from_elsewhere(model, file);
  const std::string why = why_latencies_differ(file, overrides);
  if (why.empty()) return;
  model.chains.clear();
  file.system.notes.push_back("the latencies of the model are not shown: " + why);
}

/// Threads on the CPUs of `machine: cpus`, which need not be here: nothing runs on them.
void forget_cpus(std::vector<ThreadDescription>& threads) {
  const std::vector<int>& here = available_cpus();
  for (ThreadDescription& thread : threads) {
    std::vector<int>& affinity = thread.attributes.affinity;
    const bool is_here = std::all_of(affinity.begin(), affinity.end(), [&](int cpu) {
      return std::find(here.begin(), here.end(), cpu) != here.end();
    });
    if (!is_here) affinity = {here.front()};  // for a band is on one
  }
}

/// As the file has them, also the levels of a band that takes the place of a thread. There may be
/// others, which a plan has made.
void remember_cpus(const std::vector<ThreadDescription>& from, std::vector<ThreadAttributes>& to) {
  for (const auto& [attributes, where] : from) {
    for (ThreadAttributes& thread : to) {
      const bool is_level = thread.name == fmt::format("{}-{}", attributes.name, thread.priority);
      if (thread.name == attributes.name) thread.affinity = attributes.affinity;
      if (is_level && !attributes.affinity.empty()) thread.affinity = {attributes.affinity.front()};
    }
  }
}

/// Finds the nodes of a program.
auto stand_ins(AnalyzedFile& file, const nlohmann::json& nodes) {
  file.program = std::make_shared<ProgramNodes>(nodes, file.system);
  if (const auto& others = file.program->others(); !others.empty()) {
    std::vector<std::string> names;
    for (const auto& [name, topics] : others) names.push_back(name);
    file.system.notes.push_back(
        fmt::format("the program's own executors, which are not analysed, serve its nodes that are "
                    "not in the file: {}",
                    fmt::join(names, ", ")));
  }
  for (const std::string& group : file.program->own_groups()) {
    file.system.notes.push_back(fmt::format(
        "the program adds the group '{}' to an executor of its own, which is not analysed", group));
  }
  return [program = file.program](const ComponentDescription& wanted) {
    return program->find(full_name(wanted));
  };
}

}  // namespace

AnalyzedFile analyze_file(const std::string& path, const AnalyzeOptions& options) {
  return analyze_system(read_system_as(path, options.as, options.settings), options);
}

AnalyzedFile analyze_system(SystemDescription system, const AnalyzeOptions& options) {
  AnalyzedFile file{.system = std::move(system)};
  const std::string& model = options.model.empty() ? file.system.model : options.model;
  if (!model.empty()) file.measured = read_measured_model(model);
  file.machine = facts_of_machine(file.system, options.machine);
  if (options.simulated_runs != 0) file.simulated = simulate_chains(file.system, options);
  if (options.measures_overheads) measure_overheads(file.system.machine, file.machine);
  ContainerOverrides overrides = options.overrides;
  overrides.on_making = reports_exit().on_making;
  overrides.only_constructs = true;
  if (!options.nodes.is_null()) overrides.find_node = stand_ins(file, options.nodes);
  std::vector<std::shared_ptr<Node>> nodes;
  for (SystemDescription& process : split(file.system, Composition::file)) {
    const std::vector<ThreadDescription> threads = process.threads;
    process.dds.reset();  // nothing runs
    process.watches_bounds = false;
    if (!file.system.machine.cpus.empty()) forget_cpus(process.threads);
    file.containers.push_back(std::make_unique<Container>(process, overrides));
    file.processes.push_back(file.containers.back()->modelled());
    const std::vector<std::string>& notes = file.processes.back().notes;
    file.system.notes.insert(file.system.notes.end(), notes.begin(), notes.end());
    file.processes.back().is_program = file.program != nullptr;
    if (file.program != nullptr) file.processes.back().others = file.program->others();
    remember_cpus(threads, file.processes.back().threads);
    for (const auto& callback : file.processes.back().callbacks) {
      if (nodes.empty() || nodes.back() != callback.node) nodes.push_back(callback.node);
    }
  }
  std::vector<std::string> errors;
  file.chains = find_chains(file.system, nodes, errors);
  if (!errors.empty()) throw ConfigurationError(errors);
  if (file.measured) compare_with_model(file, options.overrides);
  add_threads_of_components(file);
  file.model = make_system_model(file.system, file.chains, file.processes,
                                 file.measured ? &*file.measured : nullptr, file.machine);
  for (SystemModel::Chain& chain : file.model.chains) {
    const auto* const found = file.simulated ? file.simulated->find(chain.name) : nullptr;
    if (found != nullptr) chain.simulated = found->longest;
  }
  const auto begin = std::chrono::steady_clock::now();
  file.bounds = analyze(file.model);
  file.analysis_time = std::chrono::steady_clock::now() - begin;
  const Modes modes(file.system.modes);
  auto measured = file.measured;
  if (measured) measured->chains.clear();  // it was in no mode
  for (std::size_t mode = 1; mode < modes.all().size(); ++mode) {
    const ModelledProcess in_mode = modes.modelled(mode, file.processes.front());
    SystemModel modelled = make_system_model(file.system, file.chains, {&in_mode, 1},
                                             measured ? &*measured : nullptr, file.machine);
    ModelBounds bounds = analyze(modelled);
    file.modes.push_back({modes.all()[mode].name, std::move(modelled), std::move(bounds)});
  }
  return file;
}

std::string why_not_guaranteed(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  const auto ms = [](Nanoseconds time) { return milliseconds(time) + " ms"; };
  switch (verdict(chain, bound)) {
    case Verdict::missed:
      if (chain.observed <= chain.deadline) {
        return fmt::format("takes {} in a simulation, its deadline is {}", ms(chain.simulated),
                           ms(chain.deadline));
      }
      return fmt::format("took {} in the measured run, its deadline is {}", ms(chain.observed),
                         ms(chain.deadline));
    case Verdict::refuted:
      if (bound.bound && chain.simulated > *bound.bound) {
        return fmt::format(
            "takes {} in a simulation, above its bound, {}: Takt contradicts itself; "
            "do not rely on either, and report it with the file",
            ms(chain.simulated), ms(*bound.bound));
      }
      for (const Assumption* assumption : missing(chain, bound)) {
        if (assumption->state == Assumption::State::refuted) return assumption->text;
      }
      if (const std::string lost = why_lost_in_run(chain, bound); !lost.empty()) {
        return fmt::format(
            "{}, and its bound speaks of 1 of {}: correct the file, or measure again", lost,
            bound.one_of);
      }
      return fmt::format(
          "took {} in the measured run, its bound is {}: what the file says, or the "
          "model, is not true; `--overheads measure`, or measure longer",
          ms(chain.observed), ms(*bound.bound));
    case Verdict::not_covered:
    case Verdict::bounded_if: {
      std::vector<std::string> parts;
      for (const Assumption* assumption : missing(chain, bound)) {
        parts.push_back(fmt::format("{} ({})", assumption->id, assumption->text));
      }
      return fmt::format("is {} {}", to_string(verdict(chain, bound)), fmt::join(parts, ", "));
    }
    case Verdict::may_lose:
      return fmt::format(
          "is in time, but not every instance comes through: {}; `losses: allowed` "
          "permits that",
          bound.why_lossy);
    case Verdict::no_bound:
      return fmt::format("has no bound ({}), its deadline is {}", bound.why_not,
                         ms(chain.deadline));
    default:
      return fmt::format("may take {}, its deadline is {}", ms(*bound.bound), ms(chain.deadline));
  }
}

std::string rests_on(const AnalyzedFile& file, const std::vector<std::size_t>& callbacks) {
  const auto& all = file.model.system.callbacks;
  std::map<Provenance, std::size_t> counts;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool shares_executor = std::any_of(
        callbacks.begin(), callbacks.end(),
        [&](std::size_t callback) { return all[callback].executor == all[i].executor; });
    if (shares_executor) ++counts[file.model.callbacks[i].execution];
  }
  std::vector<std::string> parts;
  for (const auto& [provenance, count] : counts) {
    std::string part = fmt::format("{} {}", to_string(provenance), count);
    if (provenance == Provenance::measured && file.measured) {
      part += fmt::format(" (+{:g} %)", 100 * file.measured->margin);
    }
    parts.push_back(std::move(part));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace takt::tools
