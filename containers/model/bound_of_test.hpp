// For tests: what the analysis says of the first chain of a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
#define TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/model/system_model.hpp"

namespace takt::test {

/// The model of a file and its bounds.
struct Analyzed {
  SystemModel model;
  ModelBounds bounds;

  const SystemModel::Chain& chain() const { return model.chains.at(0); }
  const ModelBounds::Chain& bound() const { return bounds.chains.at(0); }
  Verdict verdict() const { return takt::verdict(chain(), bound()); }
  /// Of the first chain; nullptr: it does not assume it.
  const Assumption* assumption(std::string_view id) const {
    for (const Assumption& each : chain().assumptions) {
      if (each.id == id) return &each;
    }
    return nullptr;
  }
  /// Empty: it does not assume it.
  std::string text_of(std::string_view id) const {
    const Assumption* const found = assumption(id);
    return found != nullptr ? found->text : std::string();
  }
  /// The ids of what keeps the first chain from being guaranteed.
  std::vector<std::string> missing() const {
    std::vector<std::string> result;
    for (const Assumption* each : takt::missing(chain(), bound())) result.push_back(each->id);
    return result;
  }
};

/// On a machine of its own, with nobody else.
inline const MachineFacts kQuiet{.is_known = true, .is_virtual = false};

inline Analyzed analyzed(const std::string& text, const MeasuredModel* measured = nullptr,
                         bool accepts_all = false, const MachineFacts& machine = kQuiet) {
  const ConfigurationFile file("system.yaml", text);
  SystemDescription description = file.read();
  if (accepts_all) {
    for (const AssumptionKind& kind : assumption_kinds()) {
      description.accepted.try_emplace(std::string(kind.id), "a test");
    }
  }
  std::vector<std::unique_ptr<Container>> containers;
  std::vector<ModelledProcess> processes;
  std::vector<std::shared_ptr<Node>> nodes;
  for (SystemDescription process : split(description, Composition::file)) {
    process.dds.reset();  // nothing runs
    containers.push_back(std::make_unique<Container>(process));
    processes.push_back(containers.back()->modelled());
    for (const ModelledProcess::Member& member : processes.back().nodes) {
      nodes.push_back(member.node);
    }
  }
  std::vector<std::string> errors;
  const auto chains = containers.size() == 1 ? containers[0]->plan().chains
                                             : find_chains(description, nodes, errors);
  SystemModel model = make_system_model(description, chains, processes, measured, machine);
  ModelBounds bounds = analyze(model);
  return {std::move(model), std::move(bounds)};
}

inline ModelBounds::Chain bound_of(const std::string& text,
                                   const MeasuredModel* measured = nullptr) {
  return analyzed(text, measured).bound();
}

/// If somebody has accepted all that nobody checks.
inline Verdict verdict_of(const std::string& text, const MeasuredModel* measured = nullptr) {
  return analyzed(text, measured, /*accepts_all=*/true).verdict();
}

}  // namespace takt::test

#endif  // TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
