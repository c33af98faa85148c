// SPDX-License-Identifier: Apache-2.0
#include "analyze/analyzed_file.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "table.hpp"

namespace takt::tools {

bool AnalyzedFile::is_guaranteed() const {
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    if (!tools::is_guaranteed(model.chains[i], bounds.chains[i])) return false;
  }
  return true;
}

const MeasuredChain* AnalyzedFile::observed(const SystemModel::Chain& chain) const {
  if (!measured) return nullptr;
  const auto found = std::find_if(measured->chains.begin(), measured->chains.end(),
                                  [&](const auto& other) { return other.name == chain.name; });
  return found != measured->chains.end() ? &*found : nullptr;
}

AnalyzedFile analyze_file(const std::string& path, const AnalyzeOptions& options) {
  AnalyzedFile file{.system = read_system(path, options.settings)};
  const std::string& model = options.model.empty() ? file.system.model : options.model;
  if (!model.empty()) file.measured = read_measured_model(model);
  if (file.measured &&
      !(options.overrides.executor.empty() && options.overrides.scheduler.empty())) {
    file.measured->chains.clear();  // they are of the file's own executors
    file.system.notes.push_back(
        "the latencies of the model are not shown: they are of the executors of the file");
  }
  std::vector<std::shared_ptr<Node>> nodes;
  for (SystemDescription& process : split(file.system, Composition::file)) {
    process.dds.reset();  // nothing runs
    file.containers.push_back(std::make_unique<Container>(process, options.overrides));
    file.processes.push_back(file.containers.back()->modelled());
    for (const auto& callback : file.processes.back().callbacks) {
      if (nodes.empty() || nodes.back() != callback.node) nodes.push_back(callback.node);
    }
  }
  std::vector<std::string> errors;
  file.chains = find_chains(file.system, nodes, errors);
  if (!errors.empty()) throw ConfigurationError(errors);
  file.model = make_system_model(file.system, file.chains, file.processes,
                                 file.measured ? &*file.measured : nullptr);
  file.bounds = analyze(file.model);
  return file;
}

bool is_guaranteed(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  const Verdict found = verdict(chain, bound);
  return found == Verdict::guaranteed || found == Verdict::unjudged ||
         (found == Verdict::no_bound && chain.deadline == Nanoseconds::zero());
}

std::string why_not_guaranteed(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  const auto ms = [](Nanoseconds time) { return milliseconds(time) + " ms"; };
  switch (verdict(chain, bound)) {
    case Verdict::missed:
      return fmt::format("took {} in the measured run, its deadline is {}", ms(chain.observed),
                         ms(chain.deadline));
    case Verdict::refuted:
      return fmt::format(
          "took {} in the measured run, its bound is {}: what the file says, or the "
          "model, is not true",
          ms(chain.observed), ms(*bound.bound));
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
