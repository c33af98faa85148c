// What a program of bytes acts on, and what it checks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_
#define TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/executors/sequences/model.hpp"
#include "takt/executors/wait_set.hpp"

namespace takt::sequences {

class World {
 public:
  /// `made`: collects the objects that must be gone after the world.
  World(std::span<const std::uint8_t> bytes, Api& api, std::vector<std::weak_ptr<void>>& made);
  ~World();
  /// The first promise that was broken, or empty.
  std::string run();

  /// A part is destroyed, with the last of its callbacks.
  void part_gone() noexcept;
  // The outcome of the next transition.
  std::uint8_t next_outcome() noexcept { return std::exchange(outcome_, second_outcome_); }
  void demand(bool holds, const char* promise) noexcept {
    if (!holds && broken_ == nullptr) broken_ = promise;
  }

 private:
  struct Leave {
    void operator()(Group* group) const noexcept {
      if (--group->inside == 0) group->is_moved = false;
    }
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
    return !part.is_dropped && !part.may_be_outside && !part.group->group->belongs_to(nullptr);
  }
  /// Whether its node is active, if the node has a lifecycle.
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
  void call_others(std::uint8_t what, bool in_callback);
  void call_last(bool in_callback);
  void call_in_destructor(std::uint8_t what);
  void stop_calls() noexcept { calls_in_callbacks_ = calls_in_destructors_ = 0; }
  /// A wrong call of a program throws Error, and changes nothing.
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
  void release_at();
  void add(Executor& executor);
  void remove(Executor& executor);
  void drop();
  void abandon();
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
  void check_lonely_calls(const Part& client, TimePoint begin);

  void make_action_server();
  void make_action_client();
  void accept_goal(const PartPtr& server, std::uint8_t mode, HeldGoal::Handle handle);
  Task<> reach_goal(PartPtr server, HeldGoal goal, bool lingers);
  void end_goal(HeldGoal& goal, GoalState state);
  void send_goal();
  void cancel_goal();
  void ask_result();
  std::shared_ptr<Goal> new_goal(const PartPtr& client);
  void check_result(const Goal& goal, GoalState state);
  Task<> await_goal(PartPtr part);
  static bool is_served(const Goal& goal);
  void check_end(const Goal& goal, TimePoint begin);
  void end_held_goal();
  void check_goal(const Goal& goal);

  void make_task();
  void make_receiver();
  Task<> task(PartPtr part, std::uint8_t what);
  Task<bool> step(PartPtr part, std::uint8_t what);
  Task<bool> await_answer();
  Task<> doze(PartPtr part);
  Task<> await_message(PartPtr part);

  // Spinning: spin_calls.cpp.
  template <class Call>
  bool spin(Call&& call);
  void spin_briefly();
  void spin_until();
  void make_busy(bool is_busy);
  void release_timers(bool released);
  void hold_and_release();
  void rest_endless();
  bool spin_all();
  void be_patient();
  void settle();
  void check_settled(const Part& part, TimePoint begin);
  void check_timer(const Part& part, TimePoint begin);
  void remove_from_another_thread();
  void touch_all();

  // Another executor, promises, wait sets, events: other_calls.cpp.
  void renew_other();
  template <class Call>
  bool spin_other(Call&& call);
  void spin_other_briefly();
  void keep_promise();
  void set_promise();
  void wait_for_promise(bool in_callback);
  template <class Wait>
  void set_while_it_sleeps(KeptPromise& kept, Executor& executor, bool is_other, Wait&& wait);
  static std::shared_ptr<Entity> entity_of(const Part& part);
  void add_to_set();
  void remove_from_set();
  void wait_on_set();
  void make_event();
  void check_event(const Part& part);
  void publish_lasting();

  const std::span<const std::uint8_t> bytes_;
  Api& api_;
  std::vector<std::weak_ptr<void>>& made_;
  std::size_t position_ = 0;
  SteppingClock clock_;
  std::unique_ptr<Executor> executor_, other_;
  std::shared_ptr<Node> source_;
  std::array<std::shared_ptr<Publisher<Number>>, 2> publishers_;
  std::array<std::function<void()>, 2> publish_;
  std::shared_ptr<GuardCondition> busy_;
  std::vector<Place> places_;
  std::vector<PartPtr> parts_;
  std::vector<std::shared_ptr<Goal>> goals_;
  std::vector<HeldGoal> held_;
  std::vector<std::weak_ptr<Part>> abandoned_;  // only their callbacks keep them
  std::vector<std::shared_ptr<KeptPromise>> promises_;
  WaitSet set_{clock_};
  std::vector<std::pair<std::weak_ptr<Part>, std::shared_ptr<Entity>>> members_;  // of the set
  std::array<std::weak_ptr<Part>, 2> newest_events_;
  const std::shared_ptr<World*> self_ = std::make_shared<World*>(this);
  int named_ = 0;

  const char* broken_ = nullptr;
  bool throws_next_ = false, has_thrown_ = false, is_cancelled_ = false;
  bool touches_ = false;   // the busy callback publishes and triggers
  bool are_equal_ = true;  // no callback is more urgent than another
  bool are_held_ = false;  // timers; `is_quiet_`: and no release from before the hold is left
  bool is_quiet_ = false;
  bool waits_on_set_ = false;
  std::uint8_t outcome_ = 0, second_outcome_ = 0;  // of a transition
  std::size_t calls_in_callbacks_ = 0, calls_in_destructors_ = 0, runs_ = 0, busy_left_ = 0,
              until_done_ = 0;
  Promise<int>* promise_ = nullptr;
};

template <class Make>
void World::make_part(Make&& make) {
  const Place* const chosen = any(places_);
  if (chosen == nullptr || parts_.size() == kMostParts) return;
  Place place = *chosen;  // the list may change meanwhile
  const auto part = std::make_shared<Part>(self_);
  part->node = place.node;
  part->lifecycle = place.lifecycle;
  part->group = place.groups[next() % place.groups.size()];
  attempt([&] {
    make(place, part, "part_" + std::to_string(++named_));
    made_.push_back(part);
    parts_.push_back(part);
  });
}

/// True: the spin ran to its end. Exceptions of callbacks leave it.
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

/// In a callback the spin is nested, and the callback catches exceptions that leave it. True: the
/// spin ran to its end.
template <class Call>
bool World::spin_other(Call&& call) {
  if (other_ == nullptr) return false;
  const bool had_thrown = std::exchange(has_thrown_, false);
  const std::size_t runs = std::exchange(runs_, 0);
  bool is_whole = true;
  try {
    call();
    demand(!has_thrown_, "an exception of a callback was lost");
  } catch (const Thrown&) {
    is_whole = false;
  } catch (const Refused&) {
    is_whole = false;
  } catch (const Error&) {  // it is spinning already
    is_whole = false;
  }
  has_thrown_ = had_thrown;
  runs_ = runs;
  return is_whole;
}

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_WORLD_HPP_
