// What nodes change of callbacks that were analysed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_NODE_CHANGES_HPP_
#define TAKT_CONTAINERS_WATCHING_NODE_CHANGES_HPP_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/model/system_model.hpp"

namespace TAKT_INTERNAL takt {

/// Whether its node has dropped the callback: no executor serves it any more.
/// Thread safety: from any thread. Real-time: no.
bool was_let_go(const std::shared_ptr<Entity>& entity);

/// Finds what breaks `nothing_is_changed` by the nodes' own code, or by a request to a lifecycle. A
/// container reports its own changes.
/// Thread safety: none. Real-time: no.
class NodeChanges {
 public:
  struct Found {
    std::string of, text;  // `of` tells them apart
  };

  explicit NodeChanges(const ModelledProcess& process);

  /// Sets the baseline: before the nodes are brought up.
  void begin();
  /// All changes so far.
  std::vector<Found> look() const;

 private:
  struct Watched {
    std::string name;
    std::weak_ptr<Entity> entity;
    std::weak_ptr<const Node> node;
    CallbackParameters parameters;  // as they were analysed
    std::uint32_t deactivations = 0;
  };
  static void look_at(const Watched& callback, std::vector<Found>& found);

  std::vector<Watched> callbacks_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_NODE_CHANGES_HPP_
