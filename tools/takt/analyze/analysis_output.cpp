// The results of an analysis as JSON and as tables.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/analysis/method.hpp"
#include "takt/base/counted.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "analyze/analyzed_file.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

using analysis::kUnbounded;
using nlohmann::json;

json us(analysis::Time bound) {
  return bound >= kUnbounded ? json() : json(rt::us(Nanoseconds(bound)));
}

std::string ms(analysis::Time time) {
  return time >= kUnbounded ? "-" : milliseconds(Nanoseconds(time));
}

/// The chain in the analysis; nullptr: it is not there.
const analysis::ChainBound* found(const AnalyzedFile& file, std::size_t chain) {
  return file.model.chains[chain].why_not.empty()
             ? &file.bounds.all.chains[file.model.chains[chain].index]
             : nullptr;
}

/// The method whose bound is the least.
std::string best_method(const std::vector<analysis::MethodBound>& methods, analysis::Time bound) {
  for (const analysis::MethodBound& method : methods) {
    if (bound < kUnbounded && method.bound == bound) return method.method;
  }
  return "-";
}

/// "urgency on fast, work_conserving on rest".
std::string by(const AnalyzedFile& file, const analysis::ChainBound& bound) {
  std::vector<std::string> parts;
  for (const analysis::SegmentBound& segment : bound.segments) {
    std::string part = fmt::format("{} on {}", best_method(segment.methods, segment.bound),
                                   file.model.system.executors[segment.executor].name);
    if (std::find(parts.begin(), parts.end(), part) == parts.end()) {
      parts.push_back(std::move(part));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<std::size_t> callbacks_of(const analysis::ChainBound& bound) {
  std::vector<std::size_t> result;
  for (const analysis::SegmentBound& segment : bound.segments) {
    result.insert(result.end(), segment.callbacks.begin(), segment.callbacks.end());
  }
  return result;
}

json observed_json(const MeasuredChain* observed) {
  if (observed == nullptr) return {};
  return {{"instances", observed->instances},
          {"p50", rt::us(observed->median)},
          {"p99", rt::us(observed->p99)},
          {"p999", rt::us(observed->p999)},
          {"max", rt::us(observed->longest)}};
}

json simulated_json(const AnalyzedFile& file, const SystemModel::Chain& chain) {
  const auto* const found = file.simulated ? file.simulated->find(chain.name) : nullptr;
  if (found == nullptr || found->longest == Nanoseconds::zero()) return {};
  const bool is_late = chain.deadline != Nanoseconds::zero() && found->longest > chain.deadline;
  return {{"max", rt::us(found->longest)},
          {"scenario", found->scenario},
          {"witness", is_late ? json(found->command) : json()}};
}

json simulations_json(const AnalyzedFile& file) {
  if (!file.simulated) return {};
  const std::string& why_not = file.simulated->why_not;
  return {{"runs", file.simulated->runs},
          {"duration_us", rt::us(parse_run_time(file.simulated->duration))},
          {"why_not", why_not.empty() ? json() : json(why_not)},
          {"notes", file.simulated->notes}};
}

/// What would make an assumption needless here; empty: nothing is known.
std::string remedy_here(const AnalyzedFile& file, const Assumption& assumption) {
  const AssumptionKind* const kind = assumption_kind(assumption.id);
  if (kind == nullptr || (kind->is_remedy_of_containers && file.program != nullptr)) return {};
  return remedy_of(*kind, file.may_be_watched() && !file.system.watches_bounds);
}

/// When Takt looks here; empty: it cannot.
std::string check_here(const AnalyzedFile& file, const Assumption& assumption) {
  const AssumptionKind* const kind = assumption_kind(assumption.id);
  return kind != nullptr ? check_of(*kind, file.may_be_watched()) : "";
}

json assumption_json(const AnalyzedFile& file, const Assumption& assumption) {
  const auto text = [](const std::string& of) { return of.empty() ? json() : json(of); };
  return {{"id", assumption.id},
          {"text", assumption.text},
          {"source", assumption.source},
          {"state", to_string(assumption.state)},
          {"sentences", digest_of(assumption)},
          {"check", text(check_here(file, assumption))},
          {"remedy", text(remedy_here(file, assumption))},
          {"accepted", text(assumption.accepted)}};
}

json chain_bound_json(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  return {{"name", chain.name},
          {"deadline_us",
           chain.deadline == Nanoseconds::zero() ? json() : json(rt::us(chain.deadline))},
          {"bound_us", bound.bound ? json(rt::us(*bound.bound)) : json()},
          {"verdict", to_string(verdict(chain, bound))}};
}

json chain_json(const AnalyzedFile& file, std::size_t index) {
  const SystemModel::Chain& chain = file.model.chains[index];
  const ModelBounds::Chain& bound = file.bounds.chains[index];
  json result = chain_bound_json(chain, bound);
  result.update({{"observed_us", observed_json(file.observed(chain))},
                 {"simulated_us", simulated_json(file, chain)},
                 {"reason", bound.why_not.empty() ? json() : json(bound.why_not)},
                 {"covers_one_of", bound.bound && bound.one_of != 0 ? json(bound.one_of) : json()},
                 {"losses", bound.why_lossy.empty() ? json() : json(bound.why_lossy)},
                 {"assumptions", json::array()},
                 {"missing", json::array()},
                 {"segments", json::array()}});
  for (const Assumption& assumption : chain.assumptions) {
    result["assumptions"].push_back(assumption_json(file, assumption));
  }
  for (const Assumption* assumption : missing(chain, bound)) {
    result["missing"].push_back(assumption->id);
  }
  if (found(file, index) == nullptr) return result;
  for (const analysis::SegmentBound& segment : found(file, index)->segments) {
    json callbacks = json::array(), methods = json::array();
    for (const std::size_t callback : segment.callbacks) {
      callbacks.push_back(file.model.system.callbacks[callback].name);
    }
    for (const analysis::MethodBound& method : segment.methods) {
      methods.push_back({{"name", method.method},
                         {"bound_us", us(method.bound)},
                         {"why_not", method.why_not.empty() ? json() : json(method.why_not)}});
    }
    result["segments"].push_back({{"executor", file.model.system.executors[segment.executor].name},
                                  {"callbacks", std::move(callbacks)},
                                  {"bound_us", us(segment.bound)},
                                  {"wait_us", us(segment.wait)},
                                  {"methods", std::move(methods)}});
  }
  return result;
}

json callback_json(const AnalyzedFile& file, std::size_t index) {
  const analysis::Callback& callback = file.model.system.callbacks[index];
  const SystemModel::Callback& facts = file.model.callbacks[index];
  const analysis::CallbackBound& bound = file.bounds.all.callbacks[index];
  const bool is_known = facts.execution != Provenance::unknown;
  return {{"callback", callback.name},
          {"executor", file.model.system.executors[callback.executor].name},
          {"execution_us", is_known ? us(callback.execution) : json()},
          {"rests_on", to_string(facts.execution)},
          {"period_us", facts.period == Nanoseconds::zero() ? json() : json(rt::us(facts.period))},
          {"bound_us", us(bound.bound)},
          {"method", bound.method.empty() ? json() : json(bound.method)},
          {"reason", bound.why_not.empty() ? json() : json(bound.why_not)},
          {"backlog", bound.backlog >= kUnbounded ? json() : json(bound.backlog)},
          {"depth", facts.depth == 0 ? json() : json(facts.depth)}};
}

/// What keeps the bound of a chain from being a guarantee, and what would change that.
void print_missing(const AnalyzedFile& file, const SystemModel::Chain& chain,
                   const ModelBounds::Chain& bound) {
  rt::print("{} is {}\n", chain.name, to_string(verdict(chain, bound)));
  if (bound.bound && chain.observed > *bound.bound) {
    rt::print("  {} took {} ms in the measured run, its bound is {} ms: one of these is not so\n",
              chain.name, ms(chain.observed.count()), ms(bound.bound->count()));
  }
  if (const std::string lost = why_lost_in_run(chain, bound); !lost.empty())
    rt::print("  {}, and its bound speaks of 1 of {}: one of these is not so\n", lost,
              bound.one_of);
  for (const Assumption* const assumption : missing(chain, bound)) {
    const bool is_covered = assumption->state != Assumption::State::not_covered;
    rt::print("  {}: {} ({})\n", assumption->id, assumption->text,
              is_covered && assumption->source == "nobody" ? "nobody says so" : assumption->source);
    const std::string remedy = remedy_here(file, *assumption);
    const bool may_accept =
        assumption->state == Assumption::State::unchecked && assumption->accepted.empty();
    if (!may_accept && remedy.empty()) continue;
    const std::string accept =
        fmt::format("`accept: {{{}: 'why it holds'}}`, or {}@{} for no other sentences than these",
                    assumption->id, assumption->id, digest_of(*assumption));
    rt::print("    → {}{}{}\n", remedy, may_accept && !remedy.empty() ? "; or " : "",
              may_accept ? accept : "");
  }
}

/// Of each chain without a guarantee: a scenario in which it is late, or that none was found.
void print_witnesses(const AnalyzedFile& file) {
  if (!file.simulated) return;
  const SimulatedChains& simulated = *file.simulated;
  if (!simulated.why_not.empty()) rt::print("not simulated: {}\n", simulated.why_not);
  for (const std::string& note : simulated.notes) rt::print("of the simulation: {}\n", note);
  const std::string runs =
      fmt::format("{} of {}", counted(simulated.runs, "simulated run"), simulated.duration);
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = file.model.chains[i];
    const auto* const found = simulated.find(chain.name);
    if (found == nullptr || verdict(chain, file.bounds.chains[i]) == Verdict::guaranteed) continue;
    if (found->longest == Nanoseconds::zero()) {
      rt::print("{} has no instances in {}\n", chain.name, runs);
    } else if (chain.deadline != Nanoseconds::zero() && found->longest > chain.deadline) {
      rt::print("{} is late in: {}\n", chain.name, found->command);
    } else if (chain.deadline != Nanoseconds::zero()) {
      rt::print("{} is late in none of {}\n", chain.name, runs);
    }
  }
}

void print_chains(const AnalyzedFile& file) {
  std::vector<std::string> columns{"chain",    "deadline_ms", "p99.9_ms", "max_ms",
                                   "bound_ms", "verdict",     "by",       "rests on"};
  const bool is_simulated = file.simulated && file.simulated->why_not.empty();
  if (is_simulated) columns.insert(columns.begin() + 4, "simulated_ms");
  Table chains(columns);
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = file.model.chains[i];
    const ModelBounds::Chain& bound = file.bounds.chains[i];
    const analysis::ChainBound* const details = found(file, i);
    const MeasuredChain* const observed = file.observed(chain);
    std::vector<std::string> row{
        chain.name,
        chain.deadline == Nanoseconds::zero() ? "-" : ms(chain.deadline.count()),
        observed != nullptr ? ms(observed->p999.count()) : "-",
        observed != nullptr ? ms(observed->longest.count()) : "-",
        bound.bound ? ms(bound.bound->count()) : "-",
        describe(chain, bound),
        bound.bound ? by(file, *details) : "-",
        details != nullptr ? rests_on(file, callbacks_of(*details)) : "-"};
    if (is_simulated) {
      row.insert(row.begin() + 4,
                 chain.simulated == Nanoseconds::zero() ? "-" : ms(chain.simulated.count()));
    }
    chains.add(row);
  }
  chains.print(
      "chains: from the release of the first callback to the end of the last one (p99.9 and max as "
      "measured)");
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = file.model.chains[i];
    const ModelBounds::Chain& bound = file.bounds.chains[i];
    const Verdict found = verdict(chain, bound);
    if (found == Verdict::missed || found == Verdict::refuted || found == Verdict::may_lose) {
      rt::print("{} {}\n", chain.name, why_not_guaranteed(chain, bound));
    }
    if (found == Verdict::bounded_if || found == Verdict::not_covered)
      print_missing(file, chain, bound);
    if (found == Verdict::guaranteed && !bound.why_lossy.empty()) {
      rt::print("{} is guaranteed for {}: {}\n", chain.name,
                bound.one_of == 0 ? "the instances that come through, however few"
                                  : fmt::format("1 of {} instances at least", bound.one_of),
                bound.why_lossy);
    }
    if (!bound.bound) rt::print("{} has no bound: {}\n", chain.name, bound.why_not);
  }
  print_witnesses(file);
  rt::print("\n");
}

json mode_json(const AnalyzedFile::Mode& mode) {
  json chains = json::array();
  for (std::size_t i = 0; i < mode.model.chains.size(); ++i) {
    const ModelBounds::Chain& bound = mode.bounds.chains[i];
    json chain = chain_bound_json(mode.model.chains[i], bound);
    chain["reason"] = bound.why_not.empty() ? json() : json(bound.why_not);
    chains.push_back(std::move(chain));
  }
  return {{"mode", mode.name}, {"chains", std::move(chains)}};
}

void print_mode(const AnalyzedFile::Mode& mode) {
  Table table({"chain", "deadline_ms", "bound_ms", "verdict"});
  for (std::size_t i = 0; i < mode.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = mode.model.chains[i];
    const ModelBounds::Chain& bound = mode.bounds.chains[i];
    table.add({chain.name, chain.deadline == Nanoseconds::zero() ? "-" : ms(chain.deadline.count()),
               bound.bound ? ms(bound.bound->count()) : "-", describe(chain, bound)});
  }
  table.print(fmt::format("chains in the mode '{}'", mode.name));
  for (std::size_t i = 0; i < mode.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = mode.model.chains[i];
    const ModelBounds::Chain& bound = mode.bounds.chains[i];
    const Verdict found = verdict(chain, bound);
    if (!bound.bound) {
      rt::print("{} has no bound: {}\n", chain.name, bound.why_not);
    } else if (found != Verdict::guaranteed && found != Verdict::unjudged &&
               found != Verdict::bounded_if) {  // what that lacks is said above
      rt::print("{} {}\n", chain.name, why_not_guaranteed(chain, bound));
    }
  }
}

void print_modes(const AnalyzedFile& file) {
  if (file.modes.empty()) return;
  for (const AnalyzedFile::Mode& mode : file.modes) print_mode(mode);
  rt::print(
      "the bounds above are of each mode by itself: from a switch on there is none, until all "
      "that was ready has been served\n\n");
}

/// Why callbacks have no bound: once for all that share the reason.
void print_reasons(const AnalyzedFile& file) {
  std::map<std::string, std::vector<std::string>> names;
  for (std::size_t i = 0; i < file.model.callbacks.size(); ++i) {
    const std::string& reason = file.bounds.all.callbacks[i].why_not;
    if (!reason.empty()) names[reason].push_back(file.model.system.callbacks[i].name);
  }
  for (const auto& [reason, callbacks] : names) {
    const std::size_t others = callbacks.size() - 1;
    rt::print("no bound for {}{}: {}\n", callbacks.front(),
              others == 0 ? "" : fmt::format(" (and {} other{})", others, others == 1 ? "" : "s"),
              reason);
  }
  rt::print("\n");
}

void print_callbacks(const AnalyzedFile& file) {
  Table table({"callback", "executor", "execution_ms", "rests on", "period_ms", "bound_ms", "by",
               "waiting", "depth"});
  for (std::size_t i = 0; i < file.model.callbacks.size(); ++i) {
    const analysis::Callback& callback = file.model.system.callbacks[i];
    const SystemModel::Callback& facts = file.model.callbacks[i];
    const analysis::CallbackBound& bound = file.bounds.all.callbacks[i];
    const bool may_drop =
        facts.depth != 0 && bound.backlog > static_cast<analysis::Count>(facts.depth);
    table.add({callback.name, file.model.system.executors[callback.executor].name,
               facts.execution == Provenance::unknown ? "-" : ms(callback.execution),
               std::string(to_string(facts.execution)),
               facts.period == Nanoseconds::zero() ? "-" : ms(facts.period.count()),
               ms(bound.bound), bound.method.empty() ? "-" : bound.method,
               bound.backlog >= kUnbounded
                   ? "-"
                   : std::to_string(bound.backlog) + (may_drop ? " may drop" : ""),
               facts.depth == 0 ? "-" : std::to_string(facts.depth)});
  }
  table.print("callbacks: from the arrival that causes it in its executor to its end");
  print_reasons(file);
}

/// What matters, in a sentence.
void print_summary(const AnalyzedFile& file) {
  const auto& chains = file.bounds.chains;
  const auto bounded = std::count_if(chains.begin(), chains.end(),
                                     [](const auto& chain) { return chain.bound.has_value(); });
  std::size_t guaranteed = 0;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    if (verdict(file.model.chains[i], chains[i]) == Verdict::guaranteed) ++guaranteed;
  }
  if (chains.empty()) {
    rt::print("'{}' has no chains, so nothing is guaranteed: list them, or write `chains: auto`\n",
              file.system.file);
  } else if (bounded == 0) {
    rt::print("no chain has a bound: {}\n", chains.front().why_not);
  } else {
    rt::print("{}: {} with a bound, {} guaranteed\n", counted(chains.size(), "chain"), bounded,
              guaranteed);
  }
}

// "checked while it runs, …", "unchecked: several processes are not watched".
std::string state_here(const AnalyzedFile& file, const Assumption& assumption) {
  std::string result(to_string(assumption.state));
  if (!assumption.accepted.empty()) return "accepted: " + assumption.accepted;
  if (assumption.state == Assumption::State::checked)
    return result + " " + check_here(file, assumption);
  const AssumptionKind* const kind = assumption_kind(assumption.id);
  const bool would_be_watched = kind != nullptr && !kind->watched.empty();
  if (assumption.state != Assumption::State::unchecked || !would_be_watched ||
      file.may_be_watched()) {
    return result;
  }
  return result + (file.program != nullptr ? ": a program is not watched"
                                           : ": several processes are not watched");
}

}  // namespace

json analysis_json(const AnalyzedFile& file) {
  json chains = json::array(), callbacks = json::array(), assumptions = json::array();
  for (const Assumption& each : file.model.assumptions) assumptions.push_back(each.text);
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) chains.push_back(chain_json(file, i));
  for (std::size_t i = 0; i < file.model.callbacks.size(); ++i) {
    callbacks.push_back(callback_json(file, i));
  }
  json modes = json::array();
  for (const AnalyzedFile::Mode& mode : file.modes) modes.push_back(mode_json(mode));
  return {{"file", file.system.file},
          {"model", file.measured ? json(file.measured->file) : json()},
          {"guaranteed", file.is_all_guaranteed()},
          {"chains", std::move(chains)},
          {"modes", std::move(modes)},
          {"simulated", simulations_json(file)},
          {"callbacks", std::move(callbacks)},
          {"assumptions", std::move(assumptions)}};
}

json bounds_json(const AnalyzedFile& file) {
  json chains = json::array();
  bool is_schedulable = !file.model.chains.empty();
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const auto& bound = file.bounds.chains[i].bound;
    is_schedulable &= bound && *bound <= file.model.chains[i].deadline;
    chains.push_back(chain_bound_json(file.model.chains[i], file.bounds.chains[i]));
  }
  return {{"chains", std::move(chains)}, {"is_schedulable", is_schedulable}};
}

void print_analysis(const AnalyzedFile& file) {
  print_summary(file);
  print_chains(file);
  print_modes(file);
  print_callbacks(file);
  rt::print("assumptions\n");
  for (std::size_t i = 0; i < file.model.assumptions.size(); ++i) {
    const Assumption& each = file.model.assumptions[i];
    rt::print("  {}  {}: {} ({}; {})\n", i + 1, each.id, each.text, each.source,
              state_here(file, each));
  }
}

void print_explanation(const AnalyzedFile& file, const std::string& name) {
  std::vector<std::string> names;
  for (const SystemModel::Chain& chain : file.model.chains) names.push_back(chain.name);
  const auto index =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  if (index == names.size())
    throw Error(fmt::format("no chain is called '{}'", name), suggest(name, names));
  const ModelBounds::Chain& bound = file.bounds.chains[index];
  rt::print("chain '{}': {}\n", name,
            bound.bound ? fmt::format("{} ms at most", ms(bound.bound->count()))
                        : "no bound: " + bound.why_not);
  const analysis::ChainBound* const details = found(file, index);
  if (details == nullptr) return;
  for (std::size_t i = 0; i < details->segments.size(); ++i) {
    const analysis::SegmentBound& segment = details->segments[i];
    const analysis::Executor& executor = file.model.system.executors[segment.executor];
    std::vector<std::string> path;
    for (const std::size_t callback : segment.callbacks) {
      path.push_back(file.model.system.callbacks[callback].name);
    }
    rt::print("\n{}. {} ms on '{}': {}\n", i + 1, ms(segment.bound), executor.name,
              fmt::join(path, " → "));
    std::vector<analysis::Term> terms = segment.terms;
    std::stable_sort(terms.begin(), terms.end(),
                     [](const auto& a, const auto& b) { return a.time > b.time; });
    for (const analysis::Term& term : terms) {
      rt::print("   {:>10} ms  {}\n", ms(term.time), term.what);
    }
    if (segment.wait != 0) {
      rt::print("   then {} ms at most until the other inputs of the join have come\n",
                ms(segment.wait));
    }
    for (const analysis::MethodBound& method : segment.methods) {
      if (method.method.empty()) continue;
      const auto traits = analysis::methods().traits(method.method);
      if (method.bound < kUnbounded && method.bound == segment.bound) {
        rt::print("   by {}: {}; assumes: {}. Source: {}\n", method.method,
                  analysis::methods().description(method.method), traits.assumes, traits.source);
      } else if (method.bound < kUnbounded) {
        rt::print("   by {}: {} ms\n", method.method, ms(method.bound));
      } else {
        rt::print("   not by {}: {}\n", method.method, method.why_not);
      }
    }
  }
}

}  // namespace takt::tools
