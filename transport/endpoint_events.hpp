// Events of publishers and subscriptions: matching, lost messages, missed deadlines, liveliness.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_ENDPOINT_EVENTS_HPP_
#define TAKT_TRANSPORT_ENDPOINT_EVENTS_HPP_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

enum class EndpointEvent {
  matched,             // a compatible endpoint has appeared or disappeared
  incompatible_qos,    // an endpoint of the topic does not match because of its QoS
  message_lost,        // overwritten, expired, or lost in transit
  deadline_missed,     // no message for longer than the QoS says
  liveliness_changed,  // a matched publisher is not heard of any more, or is again
};
inline constexpr std::size_t kEndpointEvents = 5;

// What a callback gets; the words are rclcpp's. `change` is since the last call of the callback.

struct MatchedStatus {
  static constexpr EndpointEvent kEvent = EndpointEvent::matched;
  static constexpr std::string_view kName = "matched";
  std::uint64_t total_count = 0, total_count_change = 0;
  std::int64_t current_count = 0, current_count_change = 0;
};
struct IncompatibleQosStatus {
  static constexpr EndpointEvent kEvent = EndpointEvent::incompatible_qos;
  static constexpr std::string_view kName = "incompatible_qos";
  std::uint64_t total_count = 0, total_count_change = 0;
  std::string_view last_policy;  // by its name in files
};
struct MessageLostStatus {
  static constexpr EndpointEvent kEvent = EndpointEvent::message_lost;
  static constexpr std::string_view kName = "message_lost";
  std::uint64_t total_count = 0, total_count_change = 0;
};
struct DeadlineMissedStatus {
  static constexpr EndpointEvent kEvent = EndpointEvent::deadline_missed;
  static constexpr std::string_view kName = "deadline_missed";
  std::uint64_t total_count = 0, total_count_change = 0;
};
/// A publisher is alive as long as it exists; one with manual liveliness, as long as it says so
/// within its lease.
struct LivelinessChangedStatus {
  static constexpr EndpointEvent kEvent = EndpointEvent::liveliness_changed;
  static constexpr std::string_view kName = "liveliness_changed";
  std::int64_t alive_count = 0, alive_count_change = 0;
  std::int64_t not_alive_count = 0, not_alive_count_change = 0;
};

/// When a publisher with manual liveliness has last said that it is alive: what it shares with the
/// subscriptions of its process.
/// Thread safety: every method from any thread. Real-time: nothing blocks or allocates.
class LivelinessLease {
 public:
  LivelinessLease(Nanoseconds lease, TimePoint now) noexcept : lease_(lease), said_(now) {}
  /// True: some subscription has missed it.
  bool is_alive(TimePoint now) noexcept {
    said_.store(now);
    return is_missed_.exchange(false);
  }
  /// When it is missed if it says nothing.
  TimePoint end() const noexcept { return later(said_.load(), lease_); }
  /// A subscription misses it. Look at end() again, as it may have said something before.
  void miss() noexcept { is_missed_.store(true); }

 private:
  const Nanoseconds lease_;
  std::atomic<TimePoint> said_;
  std::atomic<bool> is_missed_{false};
};

/// Counts of one end, written by the threads that match, drop or notice.
/// Thread safety: every method from any thread.
/// Real-time: nothing blocks or allocates.
class EndpointEvents {
 public:
  class Listener {
   public:
    /// Any thread, inside a read section; neither blocks nor allocates.
    virtual void happened() noexcept = 0;

   protected:
    ~Listener() = default;
  };

  /// Sets the listener. The previous one may still be notified until wait_for_readers() has
  /// returned.
  void set_listener(EndpointEvent event, Listener* listener) noexcept {
    listeners_[static_cast<std::size_t>(event)].store(listener);
  }
  /// Notifies it no more; a listener that has replaced it stays.
  void remove_listener(EndpointEvent event, Listener* listener) noexcept {
    listeners_[static_cast<std::size_t>(event)].compare_exchange_strong(listener, nullptr);
  }

  void matched(int change) noexcept;
  /// `policy` is a literal.
  void incompatible(std::string_view policy) noexcept;
  void lost(std::uint64_t count) noexcept;
  void missed_deadlines(std::uint64_t count) noexcept;
  void liveliness_changed(int alive_change, int not_alive_change) noexcept;
  /// A publisher with manual liveliness has come, alive, or goes. Set-up only.
  void follow(std::shared_ptr<LivelinessLease> lease);
  void leave(const LivelinessLease& lease) noexcept;
  /// Counts which of these are alive, and returns the time at which that may change next.
  TimePoint look_for_leases(TimePoint now) noexcept;
  /// One of them is alive again: tells the listener, which is to look.
  void hear_of_lease() noexcept { happened(EndpointEvent::liveliness_changed); }
  /// The last message passed then.
  void set_last_message(TimePoint time) noexcept {
    last_message_.store(time, std::memory_order_relaxed);
  }
  /// {}: there was none.
  TimePoint last_message() const noexcept { return last_message_.load(std::memory_order_relaxed); }

  // The present status, and what has changed since `before`.
  MatchedStatus status(const MatchedStatus& before) const noexcept;
  IncompatibleQosStatus status(const IncompatibleQosStatus& before) const noexcept;
  MessageLostStatus status(const MessageLostStatus& before) const noexcept;
  DeadlineMissedStatus status(const DeadlineMissedStatus& before) const noexcept;
  LivelinessChangedStatus status(const LivelinessChangedStatus& before) const noexcept;

 private:
  void happened(EndpointEvent event) noexcept;

  std::atomic<std::uint64_t> total_matched_{0}, incompatible_{0}, lost_{0}, missed_{0};
  std::atomic<std::int64_t> matched_{0}, alive_{0}, not_alive_{0};
  std::atomic<const char*> last_policy_{""};
  std::atomic<TimePoint> last_message_{};
  struct Followed {
    std::shared_ptr<LivelinessLease> lease;
    bool is_alive = true;  // as counted
  };
  PiMutex mutex_;  // of publishers that come and go, and who looks for them
  std::vector<Followed> followed_ TAKT_GUARDED_BY(mutex_);
  std::array<std::atomic<Listener*>, kEndpointEvents> listeners_{};
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_ENDPOINT_EVENTS_HPP_
