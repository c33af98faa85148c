// Whether the entries of `topics` name what is there.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_NAMED_TOPICS_HPP_
#define TAKT_CONTAINERS_NAMED_TOPICS_HPP_

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/error.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_INTERNAL takt {

/// "/map", from the topic of a service's requests or replies: "rq/mapRequest", "rr/mapReply".
std::string service_of(std::string_view topic);

/// The name of its entry in `topics`: of its topic or, of a service or a client, of the service.
std::string entry_of(const Entity& receiver);

/// Errors of entries that set nothing: they name no topic of these nodes, nor a service with a
/// `delay` and no other key.
/// Thread safety: from any thread. Real-time: no.
std::vector<Error> wrong_topics(const SystemDescription& description,
                                std::span<const std::shared_ptr<Node>> nodes);

}  // namespace takt

#endif  // TAKT_CONTAINERS_NAMED_TOPICS_HPP_
