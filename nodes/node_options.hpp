// Settings of nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_OPTIONS_HPP_
#define TAKT_NODES_NODE_OPTIONS_HPP_

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "takt/base/clock.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/parameter.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// The rights of a node that another process has asked for.
struct Guest {
  std::string recordings;  // the folder beneath which it may use files; empty: none
};

/// Settings of a node that the system description gives. A component's constructor takes them and
/// passes them to Node.
struct NodeOptions {
  std::string name;        // replaces the name in the code
  std::string name_space;  // "/front"; empty: the root
  Parameters parameters;   // replace the declared defaults
  /// Setting a parameter that was not declared declares it, of any type; its value is not set
  /// before.
  bool allow_undeclared_parameters = false;
  /// As in rclcpp: an integer is not taken for a floating-point number, nor a list for one of
  /// another type.
  bool exact_parameter_types = false;
  std::map<std::string, std::string, std::less<>> remap;  // topic in the code → topic to use
  TopicQos qos;  // replaces the QoS in the code, by the topic's full name
  Clock* clock = &Clock::steady();
  /// Sets the node's time while its parameter `use_sim_time` is true: see TimeSource. Without one,
  /// the parameter's value cannot change.
  std::shared_ptr<SimulatedClock::Source> time_source;
  std::optional<LogLevel> log_level;  // of Node::log; nullopt: that of the process
  /// Connects the node to other processes; without it, messages stay in the process.
  std::shared_ptr<Participant> participant;
  /// Set if a request of another process makes the node: that process, not the owner of this one,
  /// gives the parameters. They must not make the node use rights that the requester lacks.
  std::optional<Guest> guest;
  /// Nothing of the node is going to run: `takt check --construct`, `plan`, `graph`, `analyze` and
  /// `simulate` make it to see what it consists of. Then a constructor changes nothing outside of
  /// its process: it opens no device and writes no file.
  bool is_only_constructed = false;
  /// Ends the container that makes the node, in order, as a signal would; from any thread, without
  /// waiting. Empty: it cannot, or there is no container.
  std::function<void()> end_container;
  /// Asks the container for a mode of its file, see Container::set_mode. From any thread, without
  /// waiting, also in callbacks: it neither allocates nor blocks. False: there is none of that
  /// name. Empty: there is no container.
  std::function<bool(std::string_view mode)> request_mode;
  /// How long a thread that drops an entity of this node waits for its callback, see Node. After
  /// that it goes on: nothing of the entity begins any more, and an execution ends by itself. For
  /// programs that drop entities while they hold what a callback needs.
  Nanoseconds drop_wait = Nanoseconds::max();

  ~NodeOptions();  // not in each program's main
};

/// Each node's parameter of ROS 2 for simulated time.
inline constexpr const char* kUseSimTime = "use_sim_time";

}  // namespace takt

#endif  // TAKT_NODES_NODE_OPTIONS_HPP_
