// Nodes that stand for those of a program.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROGRAM_NODES_HPP_
#define TAKT_TOOLS_TAKT_PROGRAM_NODES_HPP_

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt::tools {

/// The names, groups, callbacks and topics of a program's nodes, as programs/description.cpp has
/// written them. The callbacks do nothing, and all messages are of one type.
class ProgramNodes {
 public:
  ProgramNodes(const nlohmann::json& description, const SystemDescription& file);
  /// nullptr: there is none of this full name.
  std::shared_ptr<Node> find(const std::string& name) const;
  /// Of the program, but not of its file.
  const ModelledProcess::OtherNodes& others() const noexcept { return others_; }
  /// Those that an executor of the program has, and the file gives none: "/node/group".
  const std::vector<std::string>& own_groups() const noexcept { return own_groups_; }

 private:
  void add(const nlohmann::json& description, const SystemDescription& file);

  const std::unique_ptr<Executor> own_;  // stands for the program's
  std::vector<std::shared_ptr<Node>> nodes_;
  std::vector<std::shared_ptr<void>> handles_;  // of what the nodes have
  ModelledProcess::OtherNodes others_;
  std::vector<std::string> own_groups_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROGRAM_NODES_HPP_
