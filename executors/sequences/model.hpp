// What the model of a program of bytes knows: nodes, entities, calls and goals.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_MODEL_HPP_
#define TAKT_EXECUTORS_SEQUENCES_MODEL_HPP_

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/executors/sequences/api.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"
#include "takt/testing/durations.hpp"

namespace takt::sequences {

using namespace std::chrono_literals;

/// A clock that advances a little whenever it is read: so a thread that polls until a time reaches
/// it.
class SteppingClock final : public Clock {
 public:
  TimePoint now() const noexcept override {
    return TimePoint(Nanoseconds(time_ns_.fetch_add(kStepNs) + kStepNs));
  }
  void advance(Nanoseconds duration) noexcept { time_ns_.fetch_add(duration.count()); }
  /// For another thread: unchanged as long as nobody moves or reads the time.
  std::int64_t trace() const noexcept { return time_ns_.load(); }

 private:
  static constexpr std::int64_t kStepNs = 1000;
  mutable std::atomic<std::int64_t> time_ns_{1'000'000};
};

/// What SuspiciousScheduler found wrong about its executor; and whether its next configure()
/// throws.
struct SchedulerWitness {
  std::atomic<const char*> complaint{nullptr};
  std::atomic<bool> refuses{false};
};
extern SchedulerWitness witness;
struct Refused {};  // by a scheduler
struct Thrown {};   // by a callback

inline constexpr std::size_t kMostNodes = 4, kMostParts = 24, kMostRuns = 100'000;
// The durations that a user may give. The first four entries of each table never change, because
// the bytes of the kept programs are indices into it.
inline constexpr Nanoseconds kCentury = kDurations[3];
inline constexpr bool is_for_ever(Nanoseconds duration) noexcept {
  return duration >= kCentury;
}
inline constexpr std::array<Nanoseconds, 7> kPeriods{1ms,      10ms, 1s, Nanoseconds::max(),
                                                     kCentury, 1ns,  0ns};
// Not 1 s: to wait for so long takes a million steps of the clock.
inline constexpr std::array<Nanoseconds, 6> kLimits{0us, 20us,    1ms, Nanoseconds::max(),
                                                    1ns, kCentury};
inline constexpr const char* kTopics[] = {"/left", "/right"};
inline constexpr const char* kServices[] = {"/twice", "/double"};

class World;

/// A lifecycle node whose transitions end as the program says.
class Managed : public LifecycleNode {
 public:
  Managed(const std::string& name, const NodeOptions& options, World& world)
      : LifecycleNode(name, options), world_(world) {}

 private:
  CallbackReturn on_configure(LifecycleState) override { return decide(); }
  CallbackReturn on_cleanup(LifecycleState) override { return decide(); }
  CallbackReturn on_activate(LifecycleState) override { return decide(); }
  CallbackReturn on_deactivate(LifecycleState) override { return decide(); }
  CallbackReturn on_shutdown(LifecycleState) override { return decide(); }
  CallbackReturn on_error(LifecycleState) override;
  CallbackReturn decide();

  World& world_;
};

struct Group {
  std::shared_ptr<CallbackGroup> group;
  int inside = 0;
  bool is_in_other = false;  // in the other executor, if in any
  /// One of its callbacks has given it to another executor, where it may run meanwhile.
  bool is_moved = false;
};

struct Place {  // of a node
  std::shared_ptr<Node> node;
  std::shared_ptr<Managed> lifecycle;  // the same node, if it has a lifecycle
  std::vector<std::shared_ptr<Group>> groups;
  std::shared_ptr<const void> refuses_odd;
};

struct Part;

/// A request on its way.
struct Call {
  int number = 0;
  TimePoint deadline = kNever;
  TimePoint lonely_end = kNever;  // its earliest end, if no service is there
  int answers = 0;
  bool is_awaited = false;                    // by a coroutine
  std::vector<std::weak_ptr<Part>> services;  // when it was sent: those that answer at once
};

/// A goal that was sent.
struct Goal {
  int number = 0;
  TimePoint sent{};
  std::weak_ptr<Part> server, client;
  std::shared_ptr<ClientGoalHandle> handle;
  int responses = 0, results = 0;
  bool is_rejected = false;
  bool is_awaited = false;  // by a coroutine of the part `waiter`, until that ends
  std::weak_ptr<Part> waiter;
  bool is_handled = false;         // the server's callback has received it
  std::optional<GoalState> ended;  // on the server's side

  bool is_without_server() const;  // a server aborts its goals when it goes
};

/// A goal that its server holds: dropping it aborts it.
class HeldGoal {
 public:
  using Handle = std::shared_ptr<ServerGoalHandle<Count>>;
  HeldGoal(Handle held, std::shared_ptr<Goal> of) : handle(std::move(held)), goal(std::move(of)) {}
  HeldGoal(HeldGoal&&) = default;
  HeldGoal& operator=(HeldGoal&&) = default;
  ~HeldGoal() {
    if (goal != nullptr && !goal->ended) goal->ended = GoalState::aborted;
  }

  Handle handle;
  std::shared_ptr<Goal> goal;
};

/// A promise that may outlive the spin that waits for it.
struct KeptPromise {
  void set() {
    if (!is_set.exchange(true)) promise.set_value(1);
  }
  Promise<int> promise;
  std::atomic<bool> is_set{false};
};

/// An entity, or one side of an action, as the model sees it. Its callbacks own it, so it is
/// destroyed with the last of them, wherever the library does that, and its destructor makes a
/// call.
struct Part {
  explicit Part(std::shared_ptr<World*> lives_in) : world(std::move(lives_in)) {}
  ~Part();
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  const std::shared_ptr<World*> world;  // points to nullptr when the world has gone
  std::weak_ptr<Node> node;
  std::weak_ptr<Managed> lifecycle;             // whose inactive state stops its callbacks
  bool is_managed = false, was_active = false;  // when its node went
  std::shared_ptr<Group> group;
  // At most one of these is set.
  std::shared_ptr<Timer> timer;
  std::shared_ptr<SubscriptionBase> subscription;  // of messages
  std::shared_ptr<GuardCondition> guard;
  std::shared_ptr<Service<Twice>> service;
  std::shared_ptr<Client<Twice>> client;
  std::shared_ptr<Receiver<Number>> receiver;
  std::shared_ptr<Entity> event;  // of matching
  std::shared_ptr<ActionServer<Count>> action_server;
  std::shared_ptr<ActionClient<Count>> action_client;

  bool is_dropped = false, is_cancelled = false, is_for_ever = false, has_thrown = false;
  bool is_endless = false;    // a timer that is always due
  bool is_irregular = false;  // a timer whose next release was set
  // It was once in a wait set, or in an executor that has gone: so it may not be where its group
  // is.
  bool may_be_outside = false;
  int topic = -1;  // of what it receives: messages or requests
  std::uint64_t published = 0, received = 0;
  // Timers: the first release of the present phase, and how many had come before.
  TimePoint phase = kNever;
  std::uint64_t releases_before = 0;
  // Tasks.
  bool is_in_task = false;
  TimePoint sleeps_until = kNever;
  std::weak_ptr<Part> awaits;  // a receiver
  // Events: the sum of what they have reported.
  MatchedStatus reported;
  std::size_t event_topic = 0;  // whose publisher it is about
  // Action servers.
  Nanoseconds result_timeout{0};
  // Services that answer later, and clients.
  bool answers_at_once = false;
  std::vector<std::pair<RequestId, int>> owed;
  Nanoseconds timeout{0}, without_service{0};
  std::vector<std::shared_ptr<Call>> calls;
  std::string action;
};
using PartPtr = std::shared_ptr<Part>;

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_MODEL_HPP_
