// A process on the domain that looks on: who is there, and what they send.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_OBSERVER_HPP_
#define TAKT_TOOLS_TAKT_OBSERVER_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "takt/executors/wait_set.hpp"
#include "takt/nodes/node.hpp"

namespace takt::tools {

/// What all commands about the graph can be told.
struct ObserverOptions {
  int domain = default_domain();
  RosGraph form = RosGraph::jazzy;
  bool all = false;  // hidden names too: those with a part that begins with '_'
  std::string json_path;
};
void add_observer_options(CLI::App& command, ObserverOptions& options, bool has_json = true);

bool is_hidden(const std::string& name);

class Observer {
 public:
  explicit Observer(const ObserverOptions& options);

  const std::shared_ptr<Participant>& participant() const noexcept { return participant_; }
  Node& node() const noexcept { return *node_; }
  /// After the time in which others are usually heard of.
  Graph graph() const;
  /// Once `is_there` says so, or when 3 s have passed.
  Graph graph(const std::function<bool(const Graph&)>& is_there) const;

  /// Whose callback `run` calls.
  void add(const std::shared_ptr<Entity>& entity) { wait_set_.add(entity); }
  /// Until the time is over (0: never), Ctrl-C, or `stop`. What arrives within 100 ms is looked at
  /// together: who looks on is not to be in the way.
  void run(Nanoseconds duration);
  void stop() noexcept { is_stopped_ = true; }

 private:
  const std::shared_ptr<Participant> participant_;
  const std::shared_ptr<Node> node_;
  WaitSet wait_set_;
  bool is_stopped_ = false;
};

/// The ends of that name. Throws the Error that lists what there is when there is none, or they
/// have different types.
std::string type_of(const std::vector<GraphEndpoint>& some,
                    const std::vector<GraphEndpoint>& others, const std::string& name,
                    const char* what);
/// "/scan", however its user has written it.
std::string absolute(const std::string& name);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_OBSERVER_HPP_
