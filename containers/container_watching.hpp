// Whether a container does what the analysis of its file assumes. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_WATCHING_HPP_
#define TAKT_CONTAINERS_CONTAINER_WATCHING_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_setting.hpp"
#include "takt/containers/running_executors.hpp"
#include "takt/containers/watching/bound_watch.hpp"

namespace TAKT_INTERNAL takt {

/// The BoundWatch of a container, and the times of its checks. Without a BoundWatch, all functions
/// do nothing.
/// Thread safety: `changed` and `add_to` from any thread; the rest from the control thread.
/// Real-time: no.
class ContainerWatch {
 public:
  using Chains = std::vector<std::shared_ptr<Chain>>;

  ContainerWatch(ContainerSetting& setting, const RunningExecutors& running, const Chains& chains);
  ~ContainerWatch();

  /// Creates the BoundWatch. Call it when executors have the callbacks but do not run them yet.
  void make(const ModelledProcess& process, const std::vector<PlannedChain>& planned);
  void begin();
  /// Calls look() once a second at most, and returns when to call this again.
  TimePoint look_in_time();
  void look(bool is_over = false);
  /// Reports a change at run time that the analysis does not cover.
  void changed(const std::string& what);
  void add_to(ProcessResult& result) const;
  void add_to(GetStatistics::Response& now) const;

 private:
  ContainerSetting& setting_;
  const RunningExecutors& running_;
  const Chains& chains_;
  // nullptr: nothing is watched
  detail::Guarded<std::unique_ptr<BoundWatch>, LockRank::bound_watch> watch_;
  TimePoint next_look_ = kNever;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_WATCHING_HPP_
