// What is published in this process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_LOCAL_TOPICS_HPP_
#define TAKT_TRANSPORT_LOCAL_TOPICS_HPP_

#include <vector>

#include "takt/transport/intra_process.hpp"

namespace takt {

/// All publishers of this process, as they are now. From any thread; not for real-time threads.
std::vector<Endpoint> local_publishers();

}  // namespace takt

#endif  // TAKT_TRANSPORT_LOCAL_TOPICS_HPP_
