// SPDX-License-Identifier: Apache-2.0
#include "analyze/analyzed_file.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

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
  return chain.deadline == Nanoseconds::zero() || (bound.bound && *bound.bound <= chain.deadline);
}

std::string_view verdict(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  if (!bound.bound) return "no bound";
  if (chain.deadline == Nanoseconds::zero()) return "-";
  return is_guaranteed(chain, bound) ? "guaranteed" : "not shown";
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
