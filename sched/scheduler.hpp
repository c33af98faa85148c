// The scheduler interface: selects the ready callback that runs next.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_SCHEDULER_HPP_
#define TAKT_SCHED_SCHEDULER_HPP_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "takt/analysis/order.hpp"
#include "takt/base/own_key.hpp"
#include "takt/base/registry.hpp"
#include "takt/base/time.hpp"
#include "takt/base/version.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// The kind of a callback; the order is that in which rclcpp serves them.
enum class EntityKind : std::uint8_t { timer, subscription, service, client, waitable };
std::string_view to_string(EntityKind kind) noexcept;

using CallbackId = std::uint32_t;
using GroupId = std::uint32_t;
using NodeId = std::uint32_t;
using ChainId = std::uint32_t;
inline constexpr ChainId kNoChain = 0;

/// The properties of a callback that do not change while it waits. If it belongs to several chains,
/// those of the most critical one. Ids count from 0 within one executor.
struct CallbackInfo {
  CallbackId id = 0;
  EntityKind kind = EntityKind::waitable;
  std::uint32_t registration = 0;  // order in which it was added to the executor
  GroupId group = 0;
  NodeId node = 0;
  int priority = 0;                               // larger is more urgent
  Nanoseconds period{0}, deadline{0}, budget{0};  // 0: none; the deadline is relative
  int criticality = 0;
  ChainId chain = kNoChain;
  std::uint32_t chain_position = 0;
  Nanoseconds chain_deadline{0};        // 0: none; relative to root_ready_time
  std::uint32_t chain_concurrency = 0;  // callbacks of the chain at a time; 0: any number

  friend bool operator==(const CallbackInfo&, const CallbackInfo&) = default;
};

/// The same callback, after all others as far as the order goes by urgencies or deadlines.
constexpr CallbackInfo demoted(CallbackInfo info) noexcept {
  info.priority = info.criticality = std::numeric_limits<int>::min();
  info.chain = kNoChain;
  info.period = info.deadline = info.chain_deadline = Nanoseconds::zero();
  return info;
}

/// One callback that is ready. The executor owns the record; there is one for each entity.
struct ReadyCallback {
  const CallbackInfo* info = nullptr;
  TimePoint ready_time{};         // when its message was published or its timer was due
  TimePoint root_ready_time{};    // the same of the callback that began its chain; or its own
  TimePoint deadline = kNever;    // absolute
  std::uint64_t sequence = 0;     // order of arrival, over the whole process
  std::uint64_t window = 0;       // number of the polling point at which it was seen
  ReadyCallback* next = nullptr;  // free for the scheduler while it holds the record
};

/// Selects the ready callback that runs next. It works on numbers only, without entities, groups
/// and threads. A busy group parks its callbacks in another scheduler of the same type, so a
/// scheduler need not consider mutual exclusion.
///
/// Thread safety: none needed, the executor serialises all calls.
/// Real-time: everything but the constructor and `configure` runs on dispatching threads: no
/// allocation, no lock, no unbounded step.
class Scheduler {
 public:
  virtual ~Scheduler() = default;
  /// Called once, before the first push, with all callbacks that will ever be pushed. May allocate
  /// and throw. When a callback is added, or its parameters change, the executor creates another
  /// scheduler and moves the waiting callbacks. One that is removed is pushed no more.
  virtual void configure(std::span<const CallbackInfo>) {}
  virtual void push(ReadyCallback& callback) noexcept = 0;
  /// The callback to run next, nullptr when there is none.
  virtual ReadyCallback* pop() noexcept = 0;
  /// The callback that pop would return; it stays in its place. Pools ask for it, unless the order
  /// is arbitrary or in turns. As it stands here, it puts the callback behind equal ones.
  virtual ReadyCallback* peek() noexcept {
    ReadyCallback* const first = pop();
    if (first != nullptr) push(*first);
    return first;
  }
  /// A callback has run for this time. It is one of those of configure(), but it may wait again
  /// already, or have been popped from the previous scheduler. Only called with `uses_time`.
  virtual void done(const ReadyCallback&, Nanoseconds /*execution_time*/) noexcept {}
};

/// A scheduler that is only an order. `Before` is a function object:
/// `bool operator()(const ReadyCallback& a, const ReadyCallback& b) const`: a runs before b.
/// Thread safety: as Scheduler.
/// Real-time: configure allocates; push and pop are O(log n), and neither block nor allocate.
template <class Before>
class HeapScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    heap_.resize(callbacks.size());
  }
  void push(ReadyCallback& callback) noexcept override {
    heap_[size_++] = &callback;
    if (size_ > 1) std::push_heap(heap_.begin(), end(), after);
  }
  ReadyCallback* pop() noexcept override {
    if (size_ == 0) return nullptr;
    if (size_ > 1) std::pop_heap(heap_.begin(), end(), after);
    return heap_[--size_];
  }
  ReadyCallback* peek() noexcept override { return size_ != 0 ? heap_.front() : nullptr; }

 private:
  // No function: heap operations would call it by its address.
  static constexpr auto after = [](const ReadyCallback* a, const ReadyCallback* b) noexcept {
    return Before()(*b, *a);
  };
  auto end() noexcept { return heap_.begin() + static_cast<std::ptrdiff_t>(size_); }

  std::vector<ReadyCallback*> heap_;  // as large as it will ever be
  std::size_t size_ = 0;
};

/// Properties of a scheduler that are known by its name. The defaults are always safe.
struct SchedulerTraits {
  /// Looks at `ready_time` and `deadline`, or overrides `done`. Without it,
  /// executors with statistics below `full` read the clock twice less for each message.
  bool uses_time = true;
  /// What it does, for `takt analyze`. A scheduler that fits none of the words has an arbitrary
  /// order, for which there are bounds, too. Which callback is more urgent, or has the earlier
  /// place, is asked of the scheduler itself. Unless the order is arbitrary or in turns, it depends
  /// on nothing but the callbacks that wait.
  analysis::Order order = analysis::Order::arbitrary;
  /// Order::by_point: what it adds to the ready time; no value: the callback comes after all
  /// others.
  std::optional<Nanoseconds> (*point)(const CallbackInfo&) = nullptr;
  /// Equally urgent callbacks that are always ready run equally often. A scheduler that does
  /// otherwise on purpose, such as the newest first, says false: the conformance suite then leaves
  /// out the tests that rely on it.
  bool takes_turns = true;
  std::vector<OwnKey> keys = {};  // of its own in the file; its constructor takes their values
};

/// Made with the values of its own keys.
using SchedulerRegistry = Registry<Scheduler, SchedulerTraits, const OwnValues&>;
extern template class Registry<Scheduler, SchedulerTraits, const OwnValues&>;
/// All schedulers of this process by name.
SchedulerRegistry& schedulers();

/// Adds to `schedulers()`; while a library is loaded by load_scheduler(), only notes it for that.
/// For the macro below. Always true. Throws Error when the name is taken.
bool register_scheduler(std::string name, SchedulerRegistry::Entry entry, const char* version);

/// With these values if its constructor takes them. For the macro below.
template <class Class>
std::unique_ptr<Scheduler> make_scheduler(const OwnValues& own) {
  if constexpr (std::is_constructible_v<Class, const OwnValues&>) {
    return std::make_unique<Class>(own);
  } else {
    return std::make_unique<Class>();
  }
}

/// At namespace scope in a .cpp file: makes `Class` known as `name`. Behind it may stand traits:
/// `.uses_time = false`.
#define TAKT_REGISTER_SCHEDULER(name, description, Class, ...)                           \
  namespace {                                                                            \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_scheduler_) = ::takt::register_scheduler( \
      name, {description, ::takt::make_scheduler<Class>, {__VA_ARGS__}}, TAKT_VERSION);  \
  }

}  // namespace takt

#endif  // TAKT_SCHED_SCHEDULER_HPP_
