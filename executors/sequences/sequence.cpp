// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/sequence.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <memory>
#include <thread>
#include <unordered_set>
#include <vector>

#include "takt/base/future.hpp"
#include "takt/executors/executor.hpp"

namespace takt::sequences {
namespace {

using namespace std::chrono_literals;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test/msg/Sequenced", value);

/// What a scheduler found wrong about its executor; and whether the next one is to refuse.
struct SchedulerWitness {
  std::atomic<const char*> complaint{nullptr};
  std::atomic<bool> refuses{false};
} witness;
struct Refused {};

/// Order of arrival, and no trust in who calls it.
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

/// It moves on by a little whenever somebody looks: so whoever waits for a time comes to it.
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

constexpr std::size_t kMostNodes = 4, kMostParts = 24, kMostRuns = 100'000;
constexpr std::array<Nanoseconds, 4> kPeriods{1ms, 10ms, 1s, Nanoseconds::max()};
constexpr std::array<Nanoseconds, 4> kLimits{0us, 20us, 1ms, Nanoseconds::max()};
constexpr const char* kTopics[] = {"/left", "/right"};

struct Thrown {};  // by a callback

class World {
 public:
  explicit World(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    const auto executor_names = executors().names();
    const auto scheduler_names = schedulers().names();
    ExecutorOptions options;
    options.scheduler = scheduler_names[next() % scheduler_names.size()];
    const std::string& type = executor_names[next() % executor_names.size()];
    options.statistics = static_cast<StatisticsLevel>(next() % 3);
    if (type == "isolated" && next() % 2 == 1) options.per = Isolation::group;
    options.clock = &clock_;
    executor_ = executors().make(type, options);
    witness.complaint = nullptr;
    witness.refuses = false;
    source_ = make_node("source");
    for (std::size_t i = 0; i < publishers_.size(); ++i) {
      publishers_[i] = source_->create_publisher<Number>(kTopics[i], 4);
    }
    // A guard condition that, when it is busy, triggers itself again.
    busy_ = source_->create_guard_condition("busy", [this] { run_busy(); });
    executor_->add_node(source_);
  }
  ~World() {
    calls_in_callbacks_ = 0;
    if (bytes_.size() % 2 == 0) executor_.reset();
    while (!parts_.empty()) drop();  // a part holds its handle, whose callback holds the part
  }

  std::string run() {
    while (broken_ == nullptr && position_ < bytes_.size()) call(/*in_callback=*/false);
    if (broken_ == nullptr) settle();
    if (broken_ == nullptr) broken_ = witness.complaint.load();
    return broken_ == nullptr ? "" : broken_;
  }

 private:
  struct Group {
    std::shared_ptr<CallbackGroup> group;
    int inside = 0;
  };
  struct Place {  // of a node
    std::shared_ptr<Node> node;
    std::vector<std::shared_ptr<Group>> groups;
  };
  /// An entity, as the model sees it. Its callback keeps it.
  struct Part {
    std::weak_ptr<Node> node;
    std::shared_ptr<Group> group;
    std::shared_ptr<Timer> timer;
    std::shared_ptr<SubscriptionBase> subscription;
    std::shared_ptr<GuardCondition> guard;
    bool is_dropped = false, is_cancelled = false, is_for_ever = false;
    int topic = -1;
    std::uint64_t published = 0, received = 0;
  };

  std::uint8_t next() noexcept { return position_ < bytes_.size() ? bytes_[position_++] : 0; }
  template <class T>
  T* any(std::vector<T>& of) noexcept {
    return of.empty() ? nullptr : &of[next() % of.size()];
  }
  void demand(bool holds, const char* promise) noexcept {
    if (!holds && broken_ == nullptr) broken_ = promise;
  }
  std::shared_ptr<Node> make_node(const std::string& name) {
    NodeOptions options;
    options.clock = &clock_;
    return std::make_shared<Node>(name, options);
  }
  static bool is_in_executor(const Part& part) noexcept {
    return !part.is_dropped && !part.group->group->belongs_to(nullptr);
  }

  // ---- Callbacks ----

  void run_busy() {
    count_run();
    if (touches_) touch_all();
    if (until_done_ != 0 && --until_done_ == 0) promise_->set_value(1);
    if (busy_left_ == 0) return;
    if (--busy_left_ == 0) demand(false, "a spin with an end ran for ever");
    busy_->trigger();
  }
  void count_run() {
    ++runs_;
    if (runs_ > kMostRuns) {
      demand(false, "callbacks ran without an end");
      executor_->cancel();
    }
  }
  // Of every part but the busy one.
  void ran(const std::shared_ptr<Part>& part) {
    count_run();
    demand(!part->is_dropped, "a callback ran after its handle was dropped");
    demand(!part->is_cancelled, "a cancelled timer ran");
    demand(!part->is_for_ever, "a timer ran whose period is for ever");
    demand(!part->group->group->belongs_to(nullptr), "a callback ran after its removal");
    ++part->received;
    const bool is_exclusive = part->group->group->type() == CallbackGroupType::MutuallyExclusive;
    demand(++part->group->inside == 1 || !is_exclusive, "callbacks of a group ran together");
    const auto leave = [](Group* group) { --group->inside; };
    const std::unique_ptr<Group, decltype(leave)> inside(part->group.get(), leave);
    if (calls_in_callbacks_ == 0) return;
    --calls_in_callbacks_;
    call(/*in_callback=*/true);
    if (std::exchange(throws_next_, false)) {
      has_thrown_ = true;
      throw Thrown{};
    }
  }

  // ---- Calls ----

  /// What a program may do wrong ends in an Error, and all is as before.
  template <class Call>
  void attempt(Call&& call) {
    try {
      call();
    } catch (const Error&) {
    } catch (const Refused&) {
    }
  }

  void call(bool in_callback) {
    const std::uint8_t what = next() % 22;
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
        return add();
      case 9:
        return remove();
      case 10:
        return drop();
      case 11:
        return set_parameters();
      case 12:
        clock_.advance(Nanoseconds(next() * 10'000));
        return;
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
      case 16:
        calls_in_callbacks_ = next() % 8;
        return;
      default:
        break;
    }
    if (in_callback) return attempt([&] { executor_->spin_some(); });  // refused: it spins
    switch (what) {
      case 17:
        return hold_and_release();
      case 18:
        return spin_briefly();
      case 19:
        return spin_until();
      case 20:
        return settle();
      default:
        return remove_from_another_thread();
    }
  }

  void make_place() {
    if (places_.size() == kMostNodes) return;
    Place place{make_node("node_" + std::to_string(++named_)), {}};
    const auto add = [&](std::shared_ptr<CallbackGroup> group) {
      place.groups.push_back(std::make_shared<Group>(Group{std::move(group)}));
    };
    add(place.node->default_callback_group());
    add(place.node->create_callback_group("exclusive", CallbackGroupType::MutuallyExclusive));
    add(place.node->create_callback_group("reentrant", CallbackGroupType::Reentrant));
    if (next() % 4 != 0) attempt([&] { executor_->add_node(place.node); });
    places_.push_back(std::move(place));
  }

  template <class Make>
  void make_part(Make&& make) {
    Place* const place = any(places_);
    if (place == nullptr || parts_.size() == kMostParts) return;
    auto part = std::make_shared<Part>();
    part->node = place->node;
    part->group = place->groups[next() % place->groups.size()];
    attempt([&] {
      make(*place->node, part, "part_" + std::to_string(++named_));
      parts_.push_back(part);
    });
  }
  void make_timer() {
    const Nanoseconds period = kPeriods[next() % kPeriods.size()];
    make_part([&](Node& node, const std::shared_ptr<Part>& part, const std::string& name) {
      part->is_for_ever = period == Nanoseconds::max();
      part->timer = node.create_timer(
          name, period, [this, part] { ran(part); }, part->group->group);
    });
  }
  void make_subscription() {
    const int topic = next() % 2;
    const std::size_t depth = 1 + next() % 4;
    make_part([&](Node& node, const std::shared_ptr<Part>& part, const std::string&) {
      part->topic = topic;
      part->subscription = node.create_subscription<Number>(
          kTopics[topic], depth, [this, part](const Number&) { ran(part); }, part->group->group);
    });
  }
  void make_guard() {
    make_part([&](Node& node, const std::shared_ptr<Part>& part, const std::string& name) {
      part->guard = node.create_guard_condition(
          name, [this, part] { ran(part); }, part->group->group);
    });
  }
  void publish(std::size_t topic) {
    for (const auto& part : parts_) {
      if (part->topic == static_cast<int>(topic)) ++part->published;
    }
    publishers_[topic]->publish(Number{1});
  }
  void trigger() {
    if (auto* part = any(parts_); part != nullptr && (*part)->guard) (*part)->guard->trigger();
  }
  void cancel_or_reset() {
    auto* const part = any(parts_);
    if (part == nullptr || !(*part)->timer) return;
    if (((*part)->is_cancelled = next() % 2 == 0)) {
      (*part)->timer->cancel();
    } else {
      (*part)->timer->reset();
    }
  }
  void add() {
    Place* const place = any(places_);
    if (place == nullptr) return;
    const std::size_t group = next() % 4;
    attempt([&] {
      if (group == 3) return executor_->add_node(place->node);
      executor_->add_callback_group(place->groups[group]->group, place->node);
    });
  }
  void remove() {
    Place* const place = any(places_);
    if (place == nullptr) return;
    const std::size_t group = next() % 4;
    attempt([&] {
      if (group == 3) {
        executor_->remove_node(place->node);
      } else {
        executor_->remove_callback_group(place->groups[group]->group, place->node);
      }
    });
  }
  void drop() {
    if (parts_.empty()) return;
    const auto part = parts_.begin() + next() % parts_.size();
    const std::shared_ptr<Part> dropped = *part;
    parts_.erase(part);
    dropped->is_dropped = true;
    dropped->timer.reset();
    dropped->subscription.reset();
    dropped->guard.reset();
  }
  void set_parameters() {
    Place* const place = any(places_);
    if (place == nullptr) return;
    are_equal_ = false;
    CallbackParameters parameters;
    parameters.priority = next() % 4;
    if (next() % 2 == 0) parameters.deadline = kLimits[1 + next() % 3];
    attempt([&] {
      place->node->set_callback_parameters({.callback_groups = {{"default", parameters}}});
    });
  }

  // ---- Spinning ----

  /// True: the spin went its whole way. What is thrown in it leaves it.
  template <class Call>
  bool spin(Call&& call) {
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

  void spin_briefly() {
    const Nanoseconds limit = kLimits[next() % kLimits.size()];
    const bool is_busy = next() % 2 == 0;
    make_busy(is_busy);
    if (limit == Nanoseconds::max() || next() % 2 == 0) {
      spin([&] { executor_->spin_some(limit); });
    } else if (limit == Nanoseconds::zero()) {
      spin([&] { executor_->spin_once(limit); });
      demand(runs_ <= 1, "spin_once ran several callbacks");
    } else {
      spin([&] { executor_->spin_all(limit); });
    }
    make_busy(false);
  }
  void spin_until() {
    const Nanoseconds limit = kLimits[1 + next() % 3];
    Promise<int> promise;
    promise_ = &promise;
    // Its callbacks make it ready, or never; then the time ends it.
    until_done_ = limit == Nanoseconds::max() || next() % 2 == 0 ? 3 : 0;
    make_busy(true);
    FutureReturnCode code{};
    const bool is_awaited = until_done_ != 0;
    const bool is_whole =
        spin([&] { code = executor_->spin_until_future_complete(promise.get_future(), limit); });
    if (is_whole && are_equal_ && is_awaited && limit == Nanoseconds::max()) {
      demand(code == FutureReturnCode::SUCCESS, "a future came, and was not waited for");
    }
    until_done_ = 0;
    make_busy(false);
  }
  void make_busy(bool is_busy) {
    busy_left_ = is_busy ? kMostRuns / 2 : 0;
    if (is_busy) busy_->trigger();
  }

  // Timers stand still while others are busy; then they go on.
  void hold_and_release() {
    calls_in_callbacks_ = 0;
    executor_->release_timers(false);
    make_busy(true);
    spin([&] { executor_->spin_all(1ms); });
    executor_->release_timers(true);
    const bool is_whole = spin([&] { executor_->spin_all(20ms); });
    make_busy(false);
    if (!is_whole || !are_equal_) return;
    for (const auto& part : parts_) {
      if (!part->timer || !is_in_executor(*part) || part->is_cancelled) continue;
      demand(clock_.now() - 10ms < *part->timer->next_release(),
             "a due timer did not run, while others kept the executor busy");
    }
  }

  void settle() {
    make_busy(false);
    const TimePoint begin = clock_.now();
    if (!spin([&] { executor_->spin_all(); })) return;
    for (const auto& part : parts_) {
      if (!is_in_executor(*part)) continue;
      if (part->timer) demand(*part->timer->next_release() > begin, "spin_all left a due timer");
      if (part->guard) demand(part->guard->ready_count() == 0, "spin_all left a guard condition");
      if (!part->subscription) continue;
      demand(part->subscription->ready_count() == 0, "spin_all left a message");
      demand(part->received + part->subscription->lost() == part->published,
             "delivered + dropped is not what was published");
    }
    if (const char* complaint = witness.complaint) demand(false, complaint);
  }

  // While callbacks publish to it and trigger it.
  void remove_from_another_thread() {
    Place* const place = any(places_);
    if (place == nullptr) return;
    calls_in_callbacks_ = 0;
    std::atomic<bool> is_removed{false};
    std::thread remover([&] {
      attempt([&] { executor_->remove_node(place->node); });
      is_removed = true;
    });
    while (!is_removed && broken_ == nullptr) {
      busy_left_ = 3;
      touches_ = true;
      busy_->trigger();
      spin([&] { executor_->spin_some(); });
    }
    touches_ = false;
    remover.join();
    touch_all();
    spin([&] { executor_->spin_some(); });
    make_busy(false);
  }
  void touch_all() {
    for (std::size_t topic = 0; topic < publishers_.size(); ++topic) publish(topic);
    for (const auto& part : parts_) {
      if (part->guard) part->guard->trigger();
    }
  }

  const std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  SteppingClock clock_;
  std::unique_ptr<Executor> executor_;
  std::shared_ptr<Node> source_;
  std::array<std::shared_ptr<Publisher<Number>>, 2> publishers_;
  std::shared_ptr<GuardCondition> busy_;
  std::vector<Place> places_;
  std::vector<std::shared_ptr<Part>> parts_;
  int named_ = 0;

  const char* broken_ = nullptr;
  bool throws_next_ = false, has_thrown_ = false, is_cancelled_ = false;
  bool touches_ = false;   // the busy callback publishes and triggers
  bool are_equal_ = true;  // no callback is more urgent than another
  std::size_t calls_in_callbacks_ = 0, runs_ = 0, busy_left_ = 0, until_done_ = 0;
  Promise<int>* promise_ = nullptr;
};

}  // namespace

std::string run(std::span<const std::uint8_t> bytes) {
  return World(bytes).run();
}

}  // namespace takt::sequences
