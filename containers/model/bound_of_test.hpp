// For tests: what the analysis says of the first chain of a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
#define TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_

#include <string>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/model/system_model.hpp"

namespace takt::test {

inline ModelBounds::Chain bound_of(const std::string& text, const MeasuredModel* measured = nullptr,
                                   Verdict* verdict = nullptr) {
  const ConfigurationFile file("system.yaml", text);
  const SystemDescription description = file.read();
  SystemDescription process_only = description;
  process_only.dds.reset();  // nothing runs
  const Container container(process_only);
  const ModelledProcess process = container.modelled();
  const SystemModel model =
      make_system_model(description, container.plan().chains, {&process, 1}, measured);
  const ModelBounds::Chain bound = analyze(model).chains.at(0);
  if (verdict != nullptr) *verdict = takt::verdict(model.chains.at(0), bound);
  return bound;
}

inline Verdict verdict_of(const std::string& text, const MeasuredModel* measured = nullptr) {
  Verdict result = Verdict::unjudged;
  bound_of(text, measured, &result);
  return result;
}

}  // namespace takt::test

#endif  // TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
