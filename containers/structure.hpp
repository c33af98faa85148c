// The parts of a container: executors, threads, nodes and chains; and the service that lists them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_STRUCTURE_HPP_
#define TAKT_CONTAINERS_STRUCTURE_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {

class Container;

/// A container as its file describes it, completed with Takt's assignments; without the container's
/// own executors, threads and nodes.
struct ContainerStructure {
  struct Thread {
    std::string name, policy;
    std::int32_t priority = 0;
    std::vector<std::int32_t> cpus;  // empty: all
  };
  struct Executor {
    std::string name, type, scheduler;  // no scheduler: the type's own
    std::vector<Thread> threads;        // empty: one without attributes
  };
  struct Callback {
    std::string node, name, executor;
  };
  /// Messages per second on a topic, from the periods of the callbacks that the node declares as
  /// its publishers.
  struct Rate {
    std::string node, topic;
    double hz = 0;
  };
  struct Step {
    std::string node, callback, topic;  // no topic: not a subscription
  };
  /// The part of a chain in this process.
  struct Chain {
    std::string name;
    std::int64_t deadline_ns = 0;  // of the whole chain; 0: none
    std::vector<Step> steps;
  };
  std::string name;
  std::vector<std::string> nodes;
  std::vector<Executor> executors;
  std::vector<Callback> callbacks;
  std::vector<Rate> rates;
  std::vector<Chain> chains;
};
TAKT_MESSAGE(ContainerStructure::Thread, "takt_interfaces/msg/StructureThread", name, policy,
             priority, cpus);
TAKT_MESSAGE(ContainerStructure::Executor, "takt_interfaces/msg/StructureExecutor", name, type,
             scheduler, threads);
TAKT_MESSAGE(ContainerStructure::Callback, "takt_interfaces/msg/StructureCallback", node, name,
             executor);
TAKT_MESSAGE(ContainerStructure::Rate, "takt_interfaces/msg/StructureRate", node, topic, hz);
TAKT_MESSAGE(ContainerStructure::Step, "takt_interfaces/msg/StructureStep", node, callback, topic);
TAKT_MESSAGE(ContainerStructure::Chain, "takt_interfaces/msg/StructureChain", name, deadline_ns,
             steps);
TAKT_MESSAGE(ContainerStructure, "takt_interfaces/msg/ContainerStructure", name, nodes, executors,
             callbacks, rates, chains);

/// Thread safety: from any thread, while the container runs. Real-time: no.
ContainerStructure structure_of(const Container& container);

/// The service `/CONTAINER/_container/get_structure`.
struct GetStructure {
  struct Request {};
  struct Response {
    ContainerStructure structure;
  };
};
TAKT_MESSAGE(GetStructure::Request, "takt_interfaces/srv/GetStructure_Request");
TAKT_MESSAGE(GetStructure::Response, "takt_interfaces/srv/GetStructure_Response", structure);

}  // namespace takt

#endif  // TAKT_CONTAINERS_STRUCTURE_HPP_
