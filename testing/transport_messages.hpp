// Messages of transport_test.cpp and its peer process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_TRANSPORT_MESSAGES_HPP_
#define TAKT_TESTING_TRANSPORT_MESSAGES_HPP_

#include <string>

#include "takt/nodes/node.hpp"

namespace takt {

struct Labelled {
  std::int64_t value = 0;
  std::string label;
};
TAKT_MESSAGE(Labelled, "test_msgs/msg/Labelled", value, label);

struct OtherLabelled {
  std::int64_t value = 0;
  double label = 0;
};
TAKT_MESSAGE(OtherLabelled, "test_msgs/msg/OtherLabelled", value, label);

struct Add {
  struct Request {
    std::int64_t a = 0, b = 0;
  };
  struct Response {
    std::int64_t sum = 0;
  };
};
TAKT_MESSAGE(Add::Request, "test_msgs/srv/Add_Request", a, b);
TAKT_MESSAGE(Add::Response, "test_msgs/srv/Add_Response", sum);

}  // namespace takt

#endif  // TAKT_TESTING_TRANSPORT_MESSAGES_HPP_
