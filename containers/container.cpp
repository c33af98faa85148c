// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/printable.hpp"
#include "takt/containers/container_parts.hpp"
#include "takt/containers/diagnostics.hpp"
#include "takt/containers/lttng.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/unloading_threads.hpp"
#include "takt/containers/watching/bound_watch.hpp"
#include "takt/executors/latency_slices.hpp"
#include "takt/sched/threads/memory_lock.hpp"

namespace takt {
namespace {

constexpr const char* kServiceThread = "container";
constexpr const char* kLifecycleThread = "lifecycle";
constexpr const char* kRequestThreads = "requests";
// Limit: requests to a container that run code of components at the same time. At it: further
// requests wait. Seen: nothing.
constexpr std::size_t kMostRequests = 3;  // that run code of users at the same time
constexpr const char* kUnloadingThread = "loader";
constexpr auto kDrainLimit = std::chrono::seconds(5);
constexpr auto kShutDownLimit = std::chrono::seconds(10);

// One that makes its nodes itself, and has DDS.
bool is_seen_program(const ContainerOverrides& overrides) {
  return overrides.find_node && overrides.participant != nullptr;
}

}  // namespace

std::vector<std::string> placements() {
  return {"file", "merged"};
}

Placement parse_placement(const std::string& word, const std::string& where) {
  const std::vector<std::string> valid = placements();
  const auto found = std::find(valid.begin(), valid.end(), word);
  if (found != valid.end()) return static_cast<Placement>(found - valid.begin());
  throw Error(fmt::format("there is no placement '{}'", printable(word)), suggest(word, valid),
              where);
}

Container::Container(const SystemDescription& description, const ContainerOverrides& overrides)
    : description_(description),
      overrides_(overrides),
      modes_(std::make_shared<Modes>(description.modes)),
      executors_(std::make_unique<RunningExecutors>()),
      trace_(std::make_unique<RunningTrace>(*executors_)),
      first_callbacks_(std::make_unique<FirstCallbacks>(*this)) {
  shared_.lock()->notes = description.notes;
  if (!overrides_.only_constructs) note(load_tracepoints_if_asked(&description_));
  if (description_.dds) {
    DdsOptions options = *description_.dds;
    options.realtime = description_.realtime;
    participant_ =
        overrides_.participant != nullptr ? overrides_.participant : Participant::create(options);
    for (const ThreadState& thread : participant_->threads()) {
      note(thread.refused);
      dds_threads_.push_back({.asked = options.threads, .in_force = thread});
    }
  }
  if (needs_manager()) time_source_ = std::make_shared<TimeSource>();
  make_components();
  make_chains();
  if (!errors_.empty()) throw ConfigurationError(errors_);
  assign();
  if (has_thread("watchdog")) {
    watchdog_ =
        std::make_shared<Watchdog>(thread("watchdog"), description_.realtime, *overrides_.clock);
    note(watchdog_->state().refused);
  }
  make_executors();
  if (!description_.modes.empty()) prepare_modes();
  if (!overrides_.mode.empty()) begin_in(overrides_.mode);
  place_components();
  if (!errors_.empty()) throw ConfigurationError(errors_);
  if (overrides_.watches_bounds || description_.watches_bounds) make_bound_watch();
  if (description_.lifecycle) make_lifecycle();
  if (needs_manager()) {
    make_manager();
    if (lifecycle_node_ != nullptr) lifecycle_services_ = manager_->serve(lifecycle_node_);
  }
  for (const auto& loaded : loaded_components()) serve(*loaded);
  unloading_threads_ = std::make_unique<UnloadingThreads>(
      thread(kUnloadingThread), has_thread(kUnloadingThread)
                                    ? description_.realtime
                                    : std::min(description_.realtime, Realtime::prefer));
}

Container::~Container() {
  end_components();
  end_executors();
  for (const auto& loaded : loaded_components()) {
    loaded->node()->remove_listener(*first_callbacks_);
  }
  unloading_threads_.reset();
  // Destroy components before their executors, in reverse order of construction.
  std::vector<std::shared_ptr<Loaded>> components;
  components.swap(shared_.lock()->components);
  while (!components.empty()) components.pop_back();
  modes_->set_waker(nullptr);
  // Executors and users may hold nodes, and so their time source.
  if (time_source_ != nullptr) time_source_->set_host(nullptr);
}

bool Container::has_thread(const std::string& name) const {
  return find_thread(description_, name) != nullptr;
}

ThreadAttributes Container::thread(const std::string& name) const {
  const ThreadDescription* const found = find_thread(description_, name);
  return found != nullptr ? found->attributes : ThreadAttributes{.name = name};
}

// Process names may contain characters that are invalid in node names.
std::string Container::own_name(const char* ending) const {
  std::string name = description_.name + ending;
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char character) { return std::isalnum(character) == 0; }, '_');
  if (std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(0, "_");
  return name;
}

// What requests, failed components and simulated time need: a node, and a thread.
bool Container::needs_manager() const {
  const auto needs_it = [](const ComponentDescription& component) {
    const auto sim_time = component.parameters.find(kUseSimTime);
    return component.on_exception == OnException::remove_node ||
           (sim_time != component.parameters.end() && sim_time->second == ParameterValue(true));
  };
  return (participant_ != nullptr && !description_.is_split_off) || is_seen_program(overrides_) ||
         has_thread(kServiceThread) || description_.lifecycle ||
         (!description_.modes.empty() && overrides_.execution_model == nullptr) ||
         std::any_of(description_.components.begin(), description_.components.end(), needs_it);
}

// What watches a program reaches it by a hidden node, as it is none of the program's; one thread
// serves it.
void Container::make_manager() {
  const bool is_program = is_seen_program(overrides_);
  NodeOptions options{.clock = overrides_.clock, .time_source = time_source_};
  options.participant = is_program ? overrides_.participant : participant_;
  service_node_ = std::make_shared<Node>((is_program ? "_" : "") + own_name(""), options);
  if (is_program) {
    manager_ =
        std::make_unique<ComponentManager>(*this, service_node_, make_own_executor(kServiceThread));
  } else {
    const bool tells_all = participant_ != nullptr && !description_.is_split_off;
    manager_ = std::make_unique<ComponentManager>(
        *this, service_node_, make_own_executor(kRequestThreads, kMostRequests),
        load_policy(description_), tells_all && description_.dds->parameter_services);
    if (tells_all && description_.dds->rosout) rosout_ = std::make_unique<Rosout>(*service_node_);
    if (tells_all && description_.dds->diagnostics)
      diagnostics_ =
          std::make_unique<Diagnostics>(*this, *service_node_, manager_->make_group("diagnostics"));
    make_own_executor(kServiceThread).add_node(service_node_);
  }
  mode_wanted_ = service_node_->create_guard_condition(
      "mode_wanted", [this] { switch_mode(); }, manager_->make_group("mode"));
  modes_->set_waker(mode_wanted_.get());
  failed_ = service_node_->create_guard_condition(
      "failed", [this] { displace_failed(); }, manager_->make_group("failed"));
  time_source_->set_host(service_node_);
}

// Heartbeats need a thread that no transition callback can block: they show that the process is
// alive.
void Container::make_lifecycle() {
  const LifecycleDescription& lifecycle = *description_.lifecycle;
  lifecycle_node_ = std::make_shared<Node>(
      own_name("_lifecycle"), NodeOptions{.clock = overrides_.clock, .participant = participant_});
  heartbeats_ = std::make_unique<HeartbeatSender>(*lifecycle_node_, lifecycle.heartbeat);
  if (lifecycle.manager.empty() || lifecycle.manager == description_.name) {
    lifecycle_ = std::make_unique<LifecycleManager>(*lifecycle_node_, lifecycle);
  }
  for (const auto& loaded : loaded_components()) {
    const std::string& name = loaded->node()->fully_qualified_name();
    const bool is_managed = std::any_of(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                        [&](const auto& managed) { return managed.name == name; });
    if (!is_managed || std::dynamic_pointer_cast<LifecycleNode>(loaded->node())) continue;
    errors_.push_back(
        fmt::format("{}: '{}' has no lifecycle; derive '{}' from LifecycleNode, or "
                    "remove it from 'bring_up'",
                    lifecycle.where, name, loaded->description.type));
  }
  if (!errors_.empty()) throw ConfigurationError(errors_);
  make_own_executor(kLifecycleThread).add_node(lifecycle_node_);
}

// ---- Exceptions ----

// Called on the thread of the failed callback.
bool Container::handle(const FailedCallback& failed) {
  const auto is_own = [&](const std::shared_ptr<Node>& node) {
    return node != nullptr && failed.node == node->fully_qualified_name();
  };
  OnException policy = OnException::terminate;
  std::string_view node = failed.node, callback = failed.callback;
  if (is_own(service_node_) || is_own(lifecycle_node_)) {
    policy = OnException::ignore;
    if (callback.starts_with('/')) {  // of a component, whose name the service has
      const std::size_t slash = callback.rfind('/');
      node = callback.substr(0, slash);
      callback.remove_prefix(slash + 1);
    }
  }
  {
    const auto shared = shared_.lock();
    if (const auto loaded = shared->find(node)) {
      policy = loaded->description.on_exception;
      loaded->has_failed = policy == OnException::remove_node;
    }
  }
  log(LogLevel::error, "{}{}{} threw: {}; {}", node, callback.starts_with('/') ? "" : "/", callback,
      text_of(failed.exception),
      policy == OnException::terminate     ? "the container stops"
      : policy == OnException::remove_node ? "its node is removed from its executors"
                                           : "ignored");
  if (policy == OnException::remove_node) failed_->trigger();
  return policy != OnException::terminate;
}

// Not called on the thread of the failed callback: two callbacks of one node that fail at the same
// time would wait for each other.
void Container::displace_failed() {
  Components failed;
  {
    const auto shared = shared_.lock();
    failed.look = shared->looks.begin();
    for (const auto& loaded : shared->components)
      if (std::exchange(loaded->has_failed, false)) failed.all.push_back(loaded);
  }
  for (const auto& loaded : failed) {
    try {
      displace(*loaded);
    } catch (const Error& error) {
      log(LogLevel::error, "{} stays: {}", loaded->node()->fully_qualified_name(), error.what());
    } catch (...) {
      log(LogLevel::error, "{} stays: its scheduler threw", loaded->node()->fully_qualified_name());
    }
  }
}

// ---- Life ----

void Container::start(std::function<void()> on_failure) {
  if (description_.lock_memory) note(lock_memory(description_.realtime));
  if (description_.cpu_dma_latency_us) {
    dma_latency_.emplace(*description_.cpu_dma_latency_us, description_.realtime);
    note(dma_latency_->refused());
  }
  // Run without the attributes of the log thread rather than fail.
  if (has_thread("log")) {
    Logger::instance().run_in_thread([&] {
      note(apply(thread("log"), std::min(description_.realtime, Realtime::prefer)).refused);
    });
  }
  if (has_thread("main")) note(apply(thread("main"), description_.realtime).refused);
  for (const auto& running : *executors_) running->executor->release_timers(false);
  executors_->start(
      description_.realtime, *overrides_.clock,
      [this](const FailedCallback& failed) { return handle(failed); }, std::move(on_failure));
  for (const auto& running : *executors_) {
    if (running->is_own) executors_->spin(*running);
  }
  for (const auto& loaded : loaded_components()) first_callbacks_->begin(*loaded);
}

void Container::release() {
  begin_bound_watch();  // before all that it watches: the kernel may take 20 ms for its part
  // The constructors created the timers at different times; now all start together.
  for (const auto& loaded : loaded_components()) {
    for (const auto& entity : loaded->node()->entities()) {
      if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
    }
  }
  if (overrides_.slices != nullptr) overrides_.slices->begin(Clock::steady().now());
  for (const auto& running : *executors_) running->executor->release_timers(true);
  if (lifecycle_ != nullptr) lifecycle_->bring_up();
  if (lifecycle_ == nullptr && participant_ == nullptr && !overrides_.find_node) {
    for (const std::string& name : unconfigured()) {
      log(LogLevel::warn,
          "lifecycle: nobody can configure '{}': the file has neither `lifecycle` nor `dds`", name);
    }
  }
  begin_counting();
}

void Container::note(std::string text) {
  if (!text.empty()) shared_.lock()->notes.push_back(std::move(text));
}

std::size_t Container::pending() const noexcept {
  std::size_t count = 0;
  for (const auto& running : *executors_) {
    // Exclude the container's own executors: heartbeats keep them busy.
    if (!running->has_ended.load() && !running->is_own) count += running->executor->pending();
  }
  return count;
}

// Waits until several polls in a row find nothing pending: one poll can miss a message that moves
// from one executor to the next.
bool Container::drain() {
  if (overrides_.execution_model != nullptr) {
    ManualClock& clock = *overrides_.clock->as_manual();
    const TimePoint end = later(clock.now(), kDrainLimit);
    for (clock.settle(); pending() != 0; clock.advance(std::chrono::milliseconds(1)))
      if (clock.now() > end) return false;
    return true;  // at once, as nothing happens between two instants
  }
  const TimePoint limit = later(Clock::steady().now(), kDrainLimit);
  for (int quiet = 0; quiet < 5; ++quiet) {
    if (pending() != 0) quiet = -1;
    if (Clock::steady().now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

// Of a simulation, callbacks may be in the middle of their work.
std::exception_ptr Container::end_executors() noexcept {
  cancel();
  if (overrides_.execution_model != nullptr)
    overrides_.clock->as_manual()->advance(std::chrono::hours(1));
  return executors_->join();
}

void Container::check_matches() {
  const std::string hint = one_sided();
  if (!hint.empty() && !description_.is_split_off) log(LogLevel::info, "{}", hint);
}

// The first call checks `must_match`.
std::string Container::one_sided() {
  std::vector<OneSidedTopic> topics;
  try {
    topics = one_sided_topics(participant_.get());
  } catch (const Error&) {  // DDS Security may forbid to read who is there
    if (description_.must_match.empty()) return "";
    throw;
  }
  if (!std::exchange(has_checked_matches_, true)) require_matches(topics);
  std::erase_if(topics, [this](const OneSidedTopic& topic) {
    return description_.must_match.contains(topic.name);  // already reported as an error
  });
  return hint_at(topics);
}

void Container::require_matches(const std::vector<OneSidedTopic>& topics) {
  for (const auto& [name, where] : description_.must_match) {
    const auto one_sided =
        std::find_if(topics.begin(), topics.end(),
                     [&required = name](const auto& topic) { return topic.name == required; });
    std::string reason;
    if (one_sided != topics.end()) {
      reason = one_sided->reason();
    } else if (!is_known_topic(name, participant_.get())) {
      reason = "it has no publisher and no subscription; check its name";
    } else {
      continue;
    }
    std::string error =
        Error(fmt::format("topic '{}' must match: {}", name, reason), "", where).what();
    log(LogLevel::error, "{}", error);
    shared_.lock()->failures.push_back(std::move(error));
  }
}

void Container::hold() {
  look_at_bounds();  // from here on a release that waits counts as one that nobody has taken
  for (const auto& running : *executors_) {
    if (!running->is_own) running->executor->release_timers(false);
  }
  end_counting();
  note(one_sided());
  for (const std::string& name : unconfigured()) {
    note(
        fmt::format("lifecycle: '{}' is not configured; list it in `lifecycle: bring_up`, or use "
                    "`takt lifecycle set`",
                    name));
  }
}

// Which no manager has led there: they are not under `bring_up`, or it could not reach them. In the
// reverse order of construction, as the manager does.
void Container::bring_down_rest() {
  Components left = loaded_components();
  std::erase_if(left.all, [](const auto& loaded) {
    const LifecycleNode* node = loaded->lifecycle();
    return node == nullptr || node->get_current_state() == LifecycleState::finalized;
  });
  if (left.all.empty()) return;
  const auto done = unloading_threads_->run([left] {
    for (auto loaded = left.all.rbegin(); loaded != left.all.rend(); ++loaded) {
      (*loaded)->lifecycle()->bring_down();
    }
  });
  done.wait_for(kShutDownLimit);
  for (const auto& loaded : left) {
    if (loaded->lifecycle()->get_current_state() == LifecycleState::finalized) continue;
    note(fmt::format("lifecycle: {} was not shut down", loaded->node()->fully_qualified_name()));
  }
}

void Container::shut_down() {
  if (lifecycle_ == nullptr) return;
  for (auto& failure : lifecycle_->failures()) shared_.lock()->failures.push_back(failure);
  for (const std::string& name : lifecycle_->shut_down(kShutDownLimit))
    note(fmt::format("lifecycle: {} was not shut down", name));
}

void Container::stop() {
  if (!drain()) {
    note(fmt::format("messages were still in transit {} s after the last timer",
                     kDrainLimit.count()));
  }
  if (overrides_.execution_model == nullptr) bring_down_rest();
  end_components();
  const std::exception_ptr failure = end_executors();
  look_at_bounds(/*is_over=*/true);
  // One that is being unloaded may complete and leave the list meanwhile.
  for (const auto& loaded : loaded_components()) complete(*loaded);
  if (failure != nullptr) std::rethrow_exception(failure);
}

void Container::cancel() noexcept {
  executors_->cancel();
}

void Container::join() {
  if (held_ == TimePoint{}) end_counting();
  if (const auto failure = executors_->join()) std::rethrow_exception(failure);
}

}  // namespace takt
