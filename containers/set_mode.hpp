// SetMode: the service that switches a container to another mode.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SET_MODE_HPP_
#define TAKT_CONTAINERS_SET_MODE_HPP_

#include <string>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {

/// The service `/CONTAINER/set_mode` of a container whose file has `modes:`, see
/// Container::set_mode. It answers when the executors have the changes.
struct SetMode {
  struct Request {
    std::string mode;
  };
  struct Response {
    bool success = false;
    std::string reason;  // why not
  };
};
TAKT_MESSAGE(SetMode::Request, "takt_interfaces/srv/SetMode_Request", mode);
TAKT_MESSAGE(SetMode::Response, "takt_interfaces/srv/SetMode_Response", success, reason);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SET_MODE_HPP_
