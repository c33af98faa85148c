// Chains: sequences of callbacks with an end-to-end deadline.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_CHAIN_HPP_
#define TAKT_NODES_CHAIN_HPP_

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/counter.hpp"
#include "takt/base/histogram.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {

class Node;

/// The settings of a chain.
struct ChainOptions {
  std::string name;
  int priority = 0;  // larger is more critical; what PiCAS calls the chain's priority
  Nanoseconds deadline{
      0};  // from the release of its first callback to the end of its last; 0: none
  std::uint32_t concurrency =
      0;  // callbacks of it that a pool runs at the same time; 0: any number
};

/// The measurements of a chain; executors/figures.hpp says what they mean.
struct ChainStatistics {
  std::uint64_t instances = 0, misses = 0, aborted = 0;
  Histogram latency;
};

/// A path of callbacks, each of which publishes what the next one receives. Its instances differ
/// from others that end in the same callback by the path that they took.
/// Thread safety: finished() is serialised by the executor of the last callback, all else may be
/// called by any thread.
/// Real-time: finished() and aborted() neither block nor allocate.
class Chain {
 public:
  /// A callback by its node and its name.
  using Step = std::pair<std::shared_ptr<Node>, std::string>;

  /// Creates the chain, before its callbacks are added to executors. Throws Error when a name does
  /// not exist, when a step does not publish what the next one receives, or when one occurs twice.
  static std::shared_ptr<Chain> create(const ChainOptions& options, const std::vector<Step>& path);

  explicit Chain(const ChainOptions& options);
  /// From 1, over the process.
  ChainId id() const noexcept { return id_; }
  const ChainOptions& options() const noexcept { return options_; }
  /// At any time, as Executor::statistics().
  ChainStatistics statistics() const;

  /// Counts the instances that take longer, for BoundWatch. Before executors have its callbacks.
  void watch(Nanoseconds bound) noexcept { bound_ = bound; }
  std::uint64_t beyond_bound() const noexcept { return beyond_bound_; }

  /// Timers release no more. A join that waits for one goes on with what another input sends, late:
  /// from here on its instances do not count.
  void end() noexcept { has_ended_.store(true, std::memory_order_relaxed); }

  // For executors.

  /// `was_joined`: it has come through a join.
  void finished(Nanoseconds latency, bool was_joined = false) noexcept {
    if (was_joined && has_ended_.load(std::memory_order_relaxed)) return;
    ++instances_;
    if (latency > bound_) ++beyond_bound_;
    if (options_.deadline != Nanoseconds::zero() && latency > options_.deadline) ++misses_;
    latency_.record(latency);
  }
  void aborted() noexcept { aborted_.fetch_add(1, std::memory_order_relaxed); }

 private:
  const ChainOptions options_;
  const ChainId id_;
  Nanoseconds bound_ = Nanoseconds::max();
  Counter<> instances_, misses_, beyond_bound_;
  std::atomic<std::uint64_t> aborted_{0};
  std::atomic<bool> has_ended_{false};
  Histogram latency_;
};

/// The aborted chain instances, whose messages are not delivered. It stores about the last 1024.
/// Thread safety: from any thread.
/// Real-time: nothing blocks or allocates.
class AbortedInstances {
 public:
  static void add(std::uint64_t instance) noexcept {
    place(instance).store(instance);
    any_.store(true);
  }
  static bool contains(std::uint64_t instance) noexcept {
    return any_.load(std::memory_order_relaxed) && finds(instance);
  }

 private:
  static bool finds(std::uint64_t instance) noexcept;
  static std::atomic<std::uint64_t>& place(std::uint64_t instance) noexcept {
    return instances_[instance % instances_.size()];
  }
  static constinit std::atomic<bool> any_;
  static constinit std::array<std::atomic<std::uint64_t>, 1024> instances_;
};

}  // namespace takt

#endif  // TAKT_NODES_CHAIN_HPP_
