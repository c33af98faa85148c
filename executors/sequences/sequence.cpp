// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/sequence.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <unordered_set>

#include <fmt/format.h>

#include "takt/executors/sequences/world.hpp"
#include "takt/testing/time_bound.hpp"

namespace takt::sequences {

SchedulerWitness witness;

namespace {

// Real time. A program takes milliseconds.
constexpr std::chrono::seconds kLongest{60};

/// Serves in order of arrival, and checks that the executor gives it each callback once.
class SuspiciousScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> infos) override {
    if (witness.refuses.exchange(false)) throw Refused{};
    for (const CallbackInfo& info : infos) known_.insert(info.id);
  }
  void push(ReadyCallback& callback) noexcept override {
    if (!known_.contains(callback.info->id)) {
      witness.complaint = "a scheduler was given a callback that it was not configured for";
    }
    if (waiting_.size() >= known_.size()) {
      witness.complaint = "a scheduler was given more callbacks than there are";
    }
    if (std::find(waiting_.begin(), waiting_.end(), &callback) != waiting_.end()) {
      witness.complaint = "a scheduler was given a callback twice";
    }
    waiting_.push_back(&callback);
  }
  ReadyCallback* pop() noexcept override {
    if (waiting_.empty()) return nullptr;
    ReadyCallback* const first = waiting_.front();
    waiting_.pop_front();
    return first;
  }

 private:
  std::unordered_set<CallbackId> known_;
  std::deque<ReadyCallback*> waiting_;
};
TAKT_REGISTER_SCHEDULER("suspicious", "order of arrival, checked: for tests", SuspiciousScheduler)

}  // namespace

World::World(std::span<const std::uint8_t> bytes, Api& api, std::vector<std::weak_ptr<void>>& made)
    : bytes_(bytes), api_(api), made_(made) {
  const auto executor_names = api_.executor_names();
  const auto scheduler_names = schedulers().names();
  ExecutorOptions options;
  options.scheduler = scheduler_names[next() % scheduler_names.size()];
  const std::string& type = executor_names[next() % executor_names.size()];
  options.statistics = static_cast<StatisticsLevel>(next() % 3);
  if (executors().traits(type).isolates && next() % 2 == 1) {
    options.per = Isolation::group;
    options.reentrant_threads = 2;
  }
  options.clock = &clock_;
  executor_ = api_.make_executor(type, options);
  witness.complaint = nullptr;
  witness.refuses = false;
  source_ = api_.make_node("source", node_options());
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    publishers_[i] = source_->create_publisher<Number>(kTopics[i], 4);
    publish_[i] = api_.make_publish(source_, publishers_[i]);
  }
  // A guard condition that, when it is busy, triggers itself again.
  busy_ = source_->create_guard_condition("busy", [this] { run_busy(); });
  executor_->add_node(source_);
}

World::~World() {
  stop_calls();
  if (bytes_.size() % 2 == 0) {
    executor_.reset();
    other_.reset();
    for (const auto& kept : promises_) kept->set();  // nobody waits for it any more
  }
  for (const auto& member : std::exchange(members_, {})) set_.remove(member.second);
  set_.wait(0ns);            // destroys its last result
  while (!parts_.empty()) {  // a part holds its handle, whose callback holds the part
    let_go(parts_.back());
  }
  for (const auto& weak : abandoned_) {
    if (const PartPtr part = weak.lock()) let_go(part);
  }
  *self_ = nullptr;
}

Part::~Part() {
  if (*world != nullptr) (*world)->part_gone();
}

std::string World::run() {
  while (broken_ == nullptr && position_ < bytes_.size()) call(/*in_callback=*/false);
  if (broken_ == nullptr) settle();
  if (broken_ == nullptr) broken_ = witness.complaint.load();
  return broken_ == nullptr ? "" : broken_;
}

// ---- Callbacks ----

void World::run_busy() {
  count_run();
  if (touches_) touch_all();
  if (until_done_ != 0 && --until_done_ == 0) promise_->set_value(1);
  if (busy_left_ == 0) return;
  if (--busy_left_ == 0) demand(false, "a spin with an end ran for ever");
  busy_->trigger();
}

void World::count_run() {
  ++runs_;
  if (runs_ == kMostRuns / 2) rest_endless();  // timers that a callback has made or reset
  if (runs_ > kMostRuns) {
    demand(false, "callbacks ran without an end");
    executor_->cancel();
    if (other_ != nullptr) other_->cancel();
  }
}

bool World::is_active(const Part& part) noexcept {
  if (!part.is_managed) return true;
  const auto lifecycle = part.lifecycle.lock();
  if (lifecycle == nullptr) return part.was_active;
  return lifecycle->get_current_state() == LifecycleState::active;
}

World::Inside World::enter(const PartPtr& part) {
  // The wait set's last result may have the handle, too.
  demand(!part->is_dropped || part->may_be_outside, "a callback ran after its handle was dropped");
  demand(is_active(*part), "a managed callback ran, and its node was not active");
  demand(!part->group->group->belongs_to(nullptr), "a callback ran after its removal");
  return enter_group(part);
}

World::Inside World::enter_group(const PartPtr& part) {
  count_run();
  const bool is_exclusive = part->group->group->type() == CallbackGroupType::MutuallyExclusive;
  demand(++part->group->inside == 1 || !is_exclusive || part->group->is_moved,
         "callbacks of a group ran together");
  return Inside(part->group.get());
}

// What each callback may do besides: make a call, and throw.
void World::act(const PartPtr& part) {
  if (calls_in_callbacks_ == 0) return;
  --calls_in_callbacks_;
  call(/*in_callback=*/true);
  if (std::exchange(throws_next_, false)) {
    has_thrown_ = part->has_thrown = true;
    throw Thrown{};
  }
}

// A callback of any part but the busy one.
void World::ran(const PartPtr& part) {
  if (part->timer != nullptr) {
    demand(!part->is_cancelled, "a cancelled timer ran");
    demand(!part->is_for_ever, "a timer ran whose period is for ever");
    demand(!is_quiet_, "a timer ran that was not released");
  }
  const Inside inside = enter(part);
  ++part->received;
  act(part);
}

// ---- Calls ----

void World::call(bool in_callback) {
  constexpr std::uint8_t kFirstSpin = 17, kFirstService = 22, kFirstOther = 40, kCalls = 64;
  const std::uint8_t what = next() % kCalls;
  if (what >= kFirstOther) return call_others(what, in_callback);
  if (what < kFirstSpin) return call_entities(what, in_callback);
  if (what >= kFirstService && what != kFirstOther - 1) return call_services(what);
  if (in_callback) return attempt([&] { executor_->spin_some(); });  // refused: it spins
  call_spins(what);
}

void World::call_entities(std::uint8_t what, bool in_callback) {
  switch (what) {
    case 0:
      return make_place();
    case 1:
      return make_timer();
    case 2:
      return make_subscription();
    case 3:
      return make_guard();
    case 4:
    case 5:
      return publish(next() % publishers_.size());
    case 6:
      return trigger();
    case 7:
      return cancel_or_reset();
    case 8:
      return add(*executor_);
    case 9:
      return remove(*executor_);
    case 10:
      return drop();
    case 11:
      return set_callback_parameters();
    case 12:
      return clock_.advance(Nanoseconds(next() * 10'000));
    case 13:
      throws_next_ = in_callback;
      return;
    case 14:
      executor_->cancel();
      is_cancelled_ = true;
      return;
    case 15:
      witness.refuses = true;
      return;
    default:
      calls_in_callbacks_ = next() % 8;
  }
}

void World::call_spins(std::uint8_t what) {
  switch (what) {
    case 17:
      return hold_and_release();
    case 18:
      return spin_briefly();
    case 19:
      return spin_until();
    case 20:
      return settle();
    case 21:
      return remove_from_another_thread();
    default:
      return wait_for_answer();
  }
}

void World::call_services(std::uint8_t what) {
  switch (what) {
    case 22:
      return make_service();
    case 23:
      return make_client();
    case 24:
    case 25:
      return send_request();
    case 26:
      return respond();
    case 27:
      return make_action_server();
    case 28:
      return make_action_client();
    case 29:
      return send_goal();
    case 30:
      return cancel_goal();
    case 31:
      return end_held_goal();
    case 32:
      return make_task();
    case 33:
      return make_receiver();
    case 34:
      return make_lifecycle_place();
    case 35:
      return request_transition();
    case 36:
      return set_node_parameters();
    case 37:
      return release_timers(next() % 2 == 0);
    default:
      return drop_node();
  }
}

void World::call_others(std::uint8_t what, bool in_callback) {
  switch (what) {
    case 40:
      if (!in_callback) renew_other();
      return;
    case 41:
    case 42:
      if (other_ != nullptr) add(*other_);
      return;
    case 43:
      if (other_ != nullptr) remove(*other_);
      return;
    case 44:
    case 45:
      return spin_other_briefly();
    case 46:
      return keep_promise();
    case 47:
      return set_promise();
    case 48:
    case 49:
    case 50:
      return wait_for_promise(in_callback);
    case 51:
    case 52:
      return add_to_set();
    case 53:
      return remove_from_set();
    case 54:
    case 55:
      return wait_on_set();
    case 56:
      return make_event();
    case 57:
      if (!in_callback) publish_lasting();
      return;
    case 58:
      return release_at();
    case 59:
      return abandon();
    case 60:
      return ask_result();
    case 61:
      return send_goal();
    case 62:
      if (!in_callback) be_patient();
      return;
    default:
      call_last(in_callback);
  }
}

void World::call_last(bool in_callback) {
  constexpr std::uint8_t kFirstOwn = 200;
  const std::uint8_t what = next();
  if (what < kFirstOwn) {
    calls_in_destructors_ = what % 8;
  } else if (!in_callback) {
    const char* const broken = api_.call_own(what - kFirstOwn, [this] { return next(); });
    if (broken != nullptr) demand(false, broken);
  }
}

// The destructor may run anywhere in the library, below any call of the model: so it makes only
// calls that leave the model's lists of nodes and goals alone.
void World::call_in_destructor(std::uint8_t what) {
  switch (what) {
    case 0:
      return publish(next() % publishers_.size());
    case 1:
      return trigger();
    case 2:
      return cancel_or_reset();
    case 3:
      return add(*executor_);
    case 4:
      return remove(*executor_);
    case 5:
      return drop();
    case 6:
      return remove_from_set();
    case 7:
      return set_promise();
    case 8:
      return spin_other_briefly();
    default:
      return add_to_set();
  }
}

void World::part_gone() noexcept {
  if (calls_in_destructors_ == 0) return;
  --calls_in_destructors_;
  call_in_destructor(next() % 10);
}

std::string run(std::span<const std::uint8_t> bytes, Api& api) {
  // What callbacks throw and goals that nobody ends is logged, a line each.
  static const bool is_silent = [] {
    Logger::instance().set_writer([](LogLevel, std::string_view) {});
    return true;
  }();
  (void)is_silent;
  const TimeBound bound(kLongest, fmt::format("program {{{}}}", fmt::join(bytes, ", ")));
  std::vector<std::weak_ptr<void>> made;
  std::string broken = World(bytes, api, made).run();
  for (const auto& each : made) {
    if (broken.empty() && !each.expired()) broken = "something outlives its last pointer";
  }
  return broken.empty() ? api.left_behind() : broken;
}

void require(std::span<const std::uint8_t> bytes, Api& api) {
  const std::string broken = run(bytes, api);
  if (broken.empty()) return;
  std::fprintf(stderr, "broken: %s\n", broken.c_str());
  std::abort();
}

}  // namespace takt::sequences
