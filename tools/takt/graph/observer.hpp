// An observer of the domain: discovers nodes and topics, and receives messages.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_OBSERVER_HPP_
#define TAKT_TOOLS_TAKT_OBSERVER_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/wait_set.hpp"
#include "takt/nodes/node.hpp"

#include "graph/domain_option.hpp"

namespace takt::tools {

/// Options of all commands about the graph.
struct ObserverOptions {
  DomainOption domain;
  RosGraph form = RosGraph::jazzy;
  bool all = false;  // include hidden names: those with a part that begins with '_'
  std::string json_path;
  std::vector<std::string> libraries;  // with message types
};
void add_observer_options(CLI::App& command, ObserverOptions& options, bool has_json = true);
/// --library, for commands that need to know types.
void add_library_option(CLI::App& command, std::vector<std::string>& libraries);

bool is_hidden(const std::string& name);

class Observer {
 public:
  /// Loads the libraries first. Throws Error if one cannot be loaded or registers no type.
  explicit Observer(const ObserverOptions& options);

  const std::shared_ptr<Participant>& participant() const noexcept { return participant_; }
  Node& node() const noexcept { return *node_; }
  /// Waits until `is_there` returns true, at most 3 s.
  Graph graph(const std::function<bool(const Graph&)>& is_there) const;
  /// Waits for the time that discovery usually takes, and then as graph(): that there is nothing is
  /// believed only late.
  Graph whole_graph(const std::function<bool(const Graph&)>& is_there) const;

  /// Adds an entity whose callbacks run() serves.
  void add(const std::shared_ptr<Entity>& entity) { wait_set_.add(entity); }
  /// Between two batches of messages, so that the observer causes few wake-ups.
  static constexpr Nanoseconds kPause = std::chrono::milliseconds(100);
  /// Runs for this time (0: no limit), until a signal, or until stop(). Serves messages in batches.
  /// Throws Interrupted if it would have ended without the signal.
  void run(Nanoseconds duration, bool ends_by_itself, Nanoseconds pause = kPause);
  void stop() noexcept { is_stopped_ = true; }

 private:
  const std::shared_ptr<Participant> participant_;
  const std::shared_ptr<Node> node_;
  WaitSet wait_set_;
  bool is_stopped_ = false;
};

/// The type of the topic or service with this name. Throws an Error, which lists what exists, if
/// there is none, or if its endpoints have different types.
std::string type_of(const std::vector<GraphEndpoint>& some,
                    const std::vector<GraphEndpoint>& others, const std::string& name,
                    const char* what);
/// Those of the topic or service with this name.
std::vector<GraphEndpoint> ends_of(const std::vector<GraphEndpoint>& all, const std::string& name);
/// What the endpoints of a process have in common: of 16 bytes "01.10.…" the first 12.
std::string process_of(const GraphEndpoint& end);
/// Adds the leading slash to a name if it is missing.
std::string absolute(const std::string& name);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_OBSERVER_HPP_
