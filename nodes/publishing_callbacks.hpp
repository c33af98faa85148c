// What a node's publishers of a topic have in common.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_PUBLISHING_CALLBACKS_HPP_
#define TAKT_NODES_PUBLISHING_CALLBACKS_HPP_

#include <cstddef>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// The callbacks of a node that publish on a topic, as the options of its publishers say.
struct PublishingCallbacks {
  std::vector<std::string> names;  // empty: any may
  bool joins = false;              // see PublisherOptions::joins
  struct Publisher {
    QoS qos;
    std::size_t loans = 0;  // see PublisherOptions::loans
    friend bool operator==(const Publisher&, const Publisher&) = default;
  };
  std::vector<Publisher> publishers = {};  // each that differs
};

}  // namespace takt

#endif  // TAKT_NODES_PUBLISHING_CALLBACKS_HPP_
