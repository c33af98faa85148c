// Sends messages while its node is active.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_LIFECYCLE_PUBLISHER_HPP_
#define TAKT_NODES_LIFECYCLE_PUBLISHER_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "takt/base/logger.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/nodes/callback_gate.hpp"

namespace TAKT_PUBLIC takt {

/// A publisher of a LifecycleNode: what is published while the node is not active goes nowhere. It
/// is counted, and a warning is logged once for each time that the node is not active. Callbacks
/// that still run while the node is being deactivated publish; a publication at that moment from
/// outside the node's managed callbacks may or may not go out.
///
/// Thread safety and real-time: as Publisher; plus one load of an atomic.
template <Message T>
class LifecyclePublisher : private Publisher<T> {
 public:
  template <class... Arguments>
  explicit LifecyclePublisher(std::shared_ptr<const CallbackGate> gate, Arguments&&... arguments)
      : Publisher<T>(std::forward<Arguments>(arguments)...), gate_(std::move(gate)) {}

  using Publisher<T>::topic;
  using Publisher<T>::subscription_count;
  using Publisher<T>::local_subscription_count;
  using Publisher<T>::borrow_loaned_message;

  bool is_activated() const noexcept { return !gate_->is_closed(); }
  /// How many messages were not published because the node was not active.
  std::uint64_t suppressed() const noexcept { return suppressed_.load(std::memory_order_relaxed); }

  void publish(LoanedMessage<T>&& message) noexcept {
    if (is_activated()) return Publisher<T>::publish(std::move(message));
    const LoanedMessage<T> goes_back(std::move(message));
    suppress();
  }
  void publish(std::unique_ptr<T> message) {
    is_activated() ? Publisher<T>::publish(std::move(message)) : suppress();
  }
  void publish(std::shared_ptr<const T> message) {
    is_activated() ? Publisher<T>::publish(std::move(message)) : suppress();
  }
  void publish(const T& message) { is_activated() ? Publisher<T>::publish(message) : suppress(); }

 private:
  [[gnu::cold, gnu::noinline]] void suppress() noexcept {
    suppressed_.fetch_add(1, std::memory_order_relaxed);
    const std::uint32_t closing = gate_->closings();
    if (warned_of_.exchange(closing, std::memory_order_relaxed) == closing) return;
    log(LogLevel::warn, "{}: nothing is published, for the node is not active", topic());
  }

  const std::shared_ptr<const CallbackGate> gate_;
  std::atomic<std::uint64_t> suppressed_{0};
  std::atomic<std::uint32_t> warned_of_{0};  // the gate's closing
};

}  // namespace takt

#endif  // TAKT_NODES_LIFECYCLE_PUBLISHER_HPP_
