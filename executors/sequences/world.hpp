// What a program of bytes acts on, and the model that checks it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_
#define TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/executors/executor.hpp"
#include "takt/executors/sequences/sequence_types.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"

namespace takt::sequences {

using namespace std::chrono_literals;

/// It advances a little whenever it is read: so a thread that waits for a time reaches it.
class SteppingClock final : public Clock {
 public:
  TimePoint now() const noexcept override {
    return TimePoint(Nanoseconds(time_ns_.fetch_add(kStepNs) + kStepNs));
  }
  void advance(Nanoseconds duration) noexcept { time_ns_.fetch_add(duration.count()); }

 private:
  static constexpr std::int64_t kStepNs = 1000;
  mutable std::atomic<std::int64_t> time_ns_{1'000'000};
};

/// What a scheduler found wrong about its executor; and whether the next one is to refuse.
struct SchedulerWitness {
  std::atomic<const char*> complaint{nullptr};
  std::atomic<bool> refuses{false};
};
extern SchedulerWitness witness;
struct Refused {};  // by a scheduler
struct Thrown {};   // by a callback

inline constexpr std::size_t kMostNodes = 4, kMostParts = 24, kMostRuns = 100'000;
inline constexpr std::array<Nanoseconds, 4> kPeriods{1ms, 10ms, 1s, Nanoseconds::max()};
inline constexpr std::array<Nanoseconds, 4> kLimits{0us, 20us, 1ms, Nanoseconds::max()};
inline constexpr const char* kTopics[] = {"/left", "/right"};
inline constexpr const char* kServices[] = {"/twice", "/double"};
inline constexpr const char* kParameter = "even";

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
};

struct Place {  // of a node
  std::shared_ptr<Node> node;
  std::shared_ptr<Managed> lifecycle;  // the same, if it has one
  std::vector<std::shared_ptr<Group>> groups;
  OnSetParametersHandle refuses_odd;
};

struct Part;

/// A request on its way.
struct Call {
  int number = 0;
  TimePoint deadline = kNever;
  TimePoint lonely_end = kNever;  // at the earliest, if no service is there
  int answers = 0;
  bool is_awaited = false;                    // by a coroutine
  std::vector<std::weak_ptr<Part>> services;  // that answer at once, when it was sent
};

/// A goal that was sent.
struct Goal {
  int number = 0;
  std::weak_ptr<Part> server, client;
  std::shared_ptr<ClientGoalHandle> handle;
  int responses = 0, results = 0;
  bool is_rejected = false;
  std::optional<GoalState> ended;  // on the server's side

  bool is_without_server() const;  // which aborts it when it goes
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

/// An entity, or an end of an action, as the model sees it. Its callbacks keep it.
struct Part {
  std::weak_ptr<Node> node;
  std::weak_ptr<Managed> lifecycle;             // that lets it rest
  bool is_managed = false, was_active = false;  // when its node went
  std::shared_ptr<Group> group;
  // One of these.
  std::shared_ptr<Timer> timer;
  std::shared_ptr<SubscriptionBase> subscription;  // of messages
  std::shared_ptr<GuardCondition> guard;
  std::shared_ptr<Service<Twice>> service;
  std::shared_ptr<Client<Twice>> client;
  std::shared_ptr<Receiver<Number>> receiver;
  std::shared_ptr<ActionServer<Count>> action_server;
  std::shared_ptr<ActionClient<Count>> action_client;

  bool is_dropped = false, is_cancelled = false, is_for_ever = false, has_thrown = false;
  int topic = -1;  // of what it receives: messages or requests
  std::uint64_t published = 0, received = 0;
  // Timers: the first release since it began, and how many had come before.
  TimePoint phase = kNever;
  std::uint64_t releases_before = 0;
  // Tasks.
  bool is_in_task = false;
  TimePoint sleeps_until = kNever;
  // Services that answer later, and clients.
  bool answers_at_once = false;
  std::vector<std::pair<RequestId, int>> owed;
  Nanoseconds timeout{0};
  std::vector<std::shared_ptr<Call>> calls;
  std::string action;
};
using PartPtr = std::shared_ptr<Part>;

class World {
 public:
  /// `made`: what must be gone after the world.
  World(std::span<const std::uint8_t> bytes, std::vector<std::weak_ptr<void>>& made);
  ~World();
  /// The first promise that was broken, or empty.
  std::string run();

  // For what a transition does.
  std::uint8_t next_outcome() noexcept { return std::exchange(outcome_, second_outcome_); }
  void demand(bool holds, const char* promise) noexcept {
    if (!holds && broken_ == nullptr) broken_ = promise;
  }

 private:
  struct Leave {
    void operator()(Group* group) const noexcept { --group->inside; }
  };
  using Inside = std::unique_ptr<Group, Leave>;

  std::uint8_t next() noexcept { return position_ < bytes_.size() ? bytes_[position_++] : 0; }
  template <class T>
  T* any(std::vector<T>& of) noexcept {
    return of.empty() ? nullptr : &of[next() % of.size()];
  }
  /// A part that is of this kind; nullptr: there is none.
  template <class Handle>
  PartPtr any_with(Handle Part::*kind) noexcept {
    std::vector<PartPtr> found;
    for (const PartPtr& part : parts_) {
      if ((*part).*kind != nullptr) found.push_back(part);
    }
    return found.empty() ? nullptr : found[next() % found.size()];
  }
  static bool is_in_executor(const Part& part) noexcept {
    return !part.is_dropped && !part.group->group->belongs_to(nullptr);
  }
  /// No lifecycle lets it rest.
  static bool is_active(const Part& part) noexcept;

  // Callbacks: sequence.cpp.
  void run_busy();
  void count_run();
  Inside enter(const PartPtr& part);
  Inside enter_group(const PartPtr& part);
  void act(const PartPtr& part);
  void ran(const PartPtr& part);

  // Calls: sequence.cpp.
  void call(bool in_callback);
  void call_entities(std::uint8_t what, bool in_callback);
  void call_services(std::uint8_t what);
  void call_spins(std::uint8_t what);
  /// What a program may do wrong ends in an Error, and all is as before.
  template <class Call>
  void attempt(Call&& call) {
    try {
      call();
    } catch (const Error&) {
    } catch (const Refused&) {
    }
  }

  // Nodes and what is simple: entity_calls.cpp.
  NodeOptions node_options();
  void make_place();
  void make_lifecycle_place();
  void add_place(Place place);
  /// `make(place, part, name)` gives the part its handle.
  template <class Make>
  void make_part(Make&& make);
  void make_timer();
  void make_subscription();
  void make_guard();
  void publish(std::size_t topic);
  void trigger();
  void begin_phase(Part& part);
  void cancel_or_reset();
  void add();
  void remove();
  void drop();
  void let_go(const PartPtr& part);
  void drop_node();
  void set_callback_parameters();
  void set_node_parameters();
  void request_transition();

  // Services, actions, coroutines: service_calls.cpp, action_calls.cpp, task_calls.cpp.
  void make_service();
  void make_client();
  std::shared_ptr<Call> begin_call(Part& client);
  void sent(const PartPtr& client, const std::shared_ptr<Call>& call);
  void answered(const PartPtr& client, Call& call, const Twice::Response* response);
  void send_request();
  void wait_for_answer();
  void respond();
  void check_calls(const Part& client, TimePoint begin);

  void make_action_server();
  void make_action_client();
  void accept_goal(const PartPtr& server, std::uint8_t mode, HeldGoal::Handle handle);
  Task<> reach_goal(PartPtr server, HeldGoal goal);
  void end_goal(HeldGoal& goal, GoalState state);
  void send_goal();
  void cancel_goal();
  void end_held_goal();
  void check_goal(const Goal& goal);

  void make_task();
  void make_receiver();
  Task<> task(PartPtr part, std::uint8_t what);
  Task<bool> step(PartPtr part, std::uint8_t what);
  Task<bool> await_answer();
  Task<> await_message();

  // Spinning: spin_calls.cpp.
  template <class Call>
  bool spin(Call&& call);
  void spin_briefly();
  void spin_until();
  void make_busy(bool is_busy);
  void release_timers(bool released);
  void hold_and_release();
  void settle();
  void check_settled(const Part& part, TimePoint begin);
  void check_timer(const Part& part, TimePoint begin);
  void remove_from_another_thread();
  void touch_all();

  const std::span<const std::uint8_t> bytes_;
  std::vector<std::weak_ptr<void>>& made_;
  std::size_t position_ = 0;
  SteppingClock clock_;
  std::unique_ptr<Executor> executor_;
  std::shared_ptr<Node> source_;
  std::array<std::shared_ptr<Publisher<Number>>, 2> publishers_;
  std::shared_ptr<GuardCondition> busy_;
  std::vector<Place> places_;
  std::vector<PartPtr> parts_;
  std::vector<std::shared_ptr<Goal>> goals_;
  std::vector<HeldGoal> held_;
  int named_ = 0;

  const char* broken_ = nullptr;
  bool throws_next_ = false, has_thrown_ = false, is_cancelled_ = false;
  bool touches_ = false;   // the busy callback publishes and triggers
  bool are_equal_ = true;  // no callback is more urgent than another
  bool are_held_ = false;  // timers; and `is_quiet_`: none that had come due before is left
  bool is_quiet_ = false;
  std::uint8_t outcome_ = 0, second_outcome_ = 0;  // of a transition
  std::size_t calls_in_callbacks_ = 0, runs_ = 0, busy_left_ = 0, until_done_ = 0;
  Promise<int>* promise_ = nullptr;
};

template <class Make>
void World::make_part(Make&& make) {
  Place* const place = any(places_);
  if (place == nullptr || parts_.size() == kMostParts) return;
  const auto part = std::make_shared<Part>();
  part->node = place->node;
  part->lifecycle = place->lifecycle;
  part->group = place->groups[next() % place->groups.size()];
  attempt([&] {
    make(*place, part, "part_" + std::to_string(++named_));
    made_.push_back(part);
    parts_.push_back(part);
  });
}

/// True: the spin went its whole way. What is thrown in it leaves it.
template <class Call>
bool World::spin(Call&& call) {
  has_thrown_ = false;
  const bool was_cancelled = is_cancelled_;
  bool has_left = false;
  runs_ = 0;
  try {
    call();
  } catch (const Thrown&) {
    has_left = true;
  } catch (const Refused&) {  // before it began
    return false;
  }
  demand(has_left || !has_thrown_, "an exception of a callback was lost");
  const bool is_whole = !has_left && !was_cancelled && !is_cancelled_;
  is_cancelled_ = false;
  throws_next_ = false;
  return is_whole;
}

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_
