// SetCallbackParameters: the service that changes parameters of callbacks at run time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SET_CALLBACK_PARAMETERS_HPP_
#define TAKT_CONTAINERS_SET_CALLBACK_PARAMETERS_HPP_

#include <map>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_INTERNAL takt {

/// The service `/CONTAINER/set_callback_parameters`. A container has it if it uses DDS or has a
/// thread called `container`. A request contains changes by node, written as in the configuration
/// file:
///   front/lidar: {callback_groups: {loop: {priority: 90}}, callbacks: {scan: {deadline: 2ms}}}
/// All changes of one node take effect together, between two callbacks; nodes follow one another.
/// If one change is invalid, none is made.
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

/// Reads the changes of a request, by node name. Throws ConfigurationError with all errors.
std::map<std::string, CallbackParameterChanges> read_parameter_changes(const std::string& text);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SET_CALLBACK_PARAMETERS_HPP_
