// Parameters of callbacks that are changed while the system runs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_PARAMETER_SERVICE_HPP_
#define TAKT_CONTAINERS_PARAMETER_SERVICE_HPP_

#include <map>
#include <string>

#include "takt/nodes/node.hpp"

namespace takt {

/// The service `/CONTAINER/set_callback_parameters` of a container that is on DDS, or that has a
/// thread entry called `container`. The changes are written as in the configuration file, by node:
///   front/lidar: {callback_groups: {loop: {priority: 90}}, callbacks: {scan: {deadline: 2ms}}}
/// Changes of one node take effect together, between two callbacks; those of several nodes one node
/// after another. When one cannot be, none is made.
struct SetCallbackParameters {
  struct Request {
    std::string changes;
  };
  struct Response {
    bool success = false;
    std::string reason;  // why not
  };
};
TAKT_MESSAGE(SetCallbackParameters::Request, "takt_interfaces/srv/SetCallbackParameters_Request",
             changes);
TAKT_MESSAGE(SetCallbackParameters::Response, "takt_interfaces/srv/SetCallbackParameters_Response",
             success, reason);

/// The changes by the node's name, as the text gives it. Throws ConfigurationError with everything
/// that is wrong.
std::map<std::string, CallbackParameterChanges> read_parameter_changes(const std::string& text);

}  // namespace takt

#endif  // TAKT_CONTAINERS_PARAMETER_SERVICE_HPP_
