// Callbacks for events of publishers and subscriptions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_QOS_EVENT_HPP_
#define TAKT_ENTITIES_QOS_EVENT_HPP_

#include <atomic>
#include <concepts>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/guard_condition.hpp"
#include "takt/entities/timer.hpp"
#include "takt/transport/endpoint_events.hpp"

namespace TAKT_PUBLIC takt {

/// The callback is called once for everything since its last call, on its executor like every
/// other. It also reports what was true already when the event was made. Made by
/// Node::create_qos_event; it may outlive its publisher or subscription.
/// Thread safety and real-time: as GuardCondition.
template <class Status>
class QosEvent final : public GuardCondition, EndpointEvents::Listener {
 public:
  using Callback = std::function<void(const Status&)>;

  QosEvent(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
           std::shared_ptr<EndpointEvents> events, Callback callback)
      : GuardCondition(std::move(name), std::move(group), clock, [this] { report_status(); }),
        events_(std::move(events)),
        callback_(std::move(callback)) {}

  /// Starts to receive notifications.
  void start() noexcept {
    events_->set_listener(Status::kEvent, this);
    trigger();
  }
  void retire() noexcept override {
    events_->remove_listener(Status::kEvent, this);
    wait_for_readers();
    GuardCondition::retire();
  }

 private:
  void happened() noexcept override { trigger(); }
  void report_status() {
    Status status;
    {
      const std::lock_guard lock(mutex_);
      status = events_->status(reported_);
      if (!differs(status)) return;
      reported_ = status;
    }
    callback_(status);
  }
  static bool differs(const MatchedStatus& status) noexcept {
    return status.total_count_change != 0 || status.current_count_change != 0;
  }
  template <class Counted>
  static bool differs(const Counted& status) noexcept {
    return status.total_count_change != 0;
  }

  const std::shared_ptr<EndpointEvents> events_;
  const Callback callback_;
  RankedMutex<LockRank::status_event> mutex_;  // in a reentrant group it runs on several threads
  Status reported_;                            // in the last callback; guarded by mutex_
};

/// A timer that is due when the next message should have passed; each time that none has, the
/// deadline is missed. As in DDS, that begins with the first message.
/// Thread safety and real-time: as Timer.
class DeadlineEvent final : public Timer {
 public:
  using Callback = std::function<void(const DeadlineMissedStatus&)>;

  DeadlineEvent(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
                Nanoseconds deadline, std::shared_ptr<EndpointEvents> events, Callback callback)
      : Timer(std::move(name), std::move(group), clock, deadline, [this] { look(); }),
        events_(std::move(events)),
        callback_(std::move(callback)) {}

 private:
  void look();

  const std::shared_ptr<EndpointEvents> events_;
  const Callback callback_;
  RankedMutex<LockRank::status_event>
      mutex_;           // guards all below: in a reentrant group it runs on several threads
  TimePoint missed_{};  // the deadline that was missed last
  DeadlineMissedStatus reported_;
};

/// A timer that is due when something has happened, or a publisher with manual liveliness may have
/// been silent for its lease. It sleeps while there is none.
/// Thread safety and real-time: as Timer; it waits for publishers that come and go, for a moment.
class LivelinessEvent final : public Timer, EndpointEvents::Listener {
 public:
  using Callback = std::function<void(const LivelinessChangedStatus&)>;

  LivelinessEvent(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
                  std::shared_ptr<EndpointEvents> events, Callback callback);
  /// Starts to receive notifications.
  void start() noexcept;
  void retire() noexcept override;

 private:
  void happened() noexcept override;
  void look();

  const std::shared_ptr<EndpointEvents> events_;
  const Callback callback_;
  std::atomic<bool> has_happened_{false};
  RankedMutex<LockRank::status_event> mutex_;  // in a reentrant group it runs on several threads
  LivelinessChangedStatus reported_;           // in the last callback; guarded by mutex_
};

/// What calls the callback of a status.
template <class Status>
using EventOf = std::conditional_t<std::same_as<Status, LivelinessChangedStatus>, LivelinessEvent,
                                   QosEvent<Status>>;

}  // namespace takt

#endif  // TAKT_ENTITIES_QOS_EVENT_HPP_
