// The ends of topics that this process has.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_LOCAL_TOPICS_HPP_
#define TAKT_TRANSPORT_LOCAL_TOPICS_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

struct LocalTopics {
  std::vector<Endpoint> publishers, subscriptions;
};

/// All of this process, as they are now. From any thread; not for real-time threads.
LocalTopics local_topics();

/// How often the publishers of a node had no message to lend, see PublisherOptions::loans.
struct RefusedLoans {
  std::string topic, node;
  std::uint64_t count = 0;
};
/// Of each publisher that is there now and has refused one. The same.
std::vector<RefusedLoans> refused_loans();

}  // namespace takt

#endif  // TAKT_TRANSPORT_LOCAL_TOPICS_HPP_
