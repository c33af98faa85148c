// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <fmt/format.h>

#include "takt/containers/document.hpp"
#include "takt/containers/system_description.hpp"
#include "takt/containers/system_reader.hpp"

namespace takt {

ConfigurationError::ConfigurationError(std::vector<std::string> errors)
    : Error(fmt::format("{}", fmt::join(errors, "\n"))), errors_(std::move(errors)) {
}

SystemDescription read_system(const std::string& path) {
  document::Errors errors(path);
  const document::Value root = document::read(path, errors);
  const bool is_workload = document::is_json(path);
  SystemDescription system =
      is_workload ? read_workload(root, errors) : read_configuration(root, errors);
  errors.throw_if_any();
  system.file = path;
  if (is_workload) system.name = std::filesystem::path(path).stem().string();
  return system;
}

}  // namespace takt
