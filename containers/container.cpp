// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <algorithm>
#include <exception>
#include <thread>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/printable.hpp"
#include "takt/containers/container_plan.hpp"
#include "takt/containers/container_services.hpp"
#include "takt/containers/guarantees.hpp"
#include "takt/containers/measured_usage.hpp"
#include "takt/containers/running_trace.hpp"
#include "takt/containers/topic_matches.hpp"
#include "takt/executors/latency_slices.hpp"
#include "takt/sched/threads/memory_lock.hpp"

namespace takt {
namespace {

constexpr const char* kUnloadingThread = "loader";
constexpr auto kDrainLimit = std::chrono::seconds(5);

// Waits until several polls in a row find nothing pending: one poll can miss a message that moves
// from one executor to the next.
bool drain(const RunningExecutors& running, const ContainerSetting& setting) {
  if (setting.is_simulated()) {
    ManualClock& clock = *setting.overrides.clock->as_manual();
    const TimePoint end = later(clock.now(), kDrainLimit);
    for (clock.settle(); running.pending() != 0; clock.advance(std::chrono::milliseconds(1)))
      if (clock.now() >= end) return false;
    return true;  // a single poll suffices: nothing runs between two simulated instants
  }
  const TimePoint limit = later(Clock::steady().now(), kDrainLimit);
  for (int quiet = 0; quiet < 5; ++quiet) {
    if (running.pending() != 0) quiet = -1;
    if (Clock::steady().now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
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
    : setting_(std::make_unique<ContainerSetting>(description, overrides)),
      running_(std::make_unique<RunningExecutors>()),
      trace_(std::make_unique<RunningTrace>(*running_)),
      components_(std::make_unique<ComponentList>()),
      executors_(std::make_unique<ContainerExecutors>(*setting_, *components_, *running_)),
      guarantees_(std::make_unique<Guarantees>(*setting_, *components_, *executors_)),
      watch_(std::make_unique<ContainerWatch>(*setting_, *running_, chains_)),
      matches_(std::make_unique<TopicMatches>(*setting_)),
      usage_(std::make_unique<MeasuredUsage>(*setting_)),
      lifecycle_(std::make_unique<ContainerLifecycle>(*setting_, *components_)),
      services_(std::make_unique<ContainerServices>(*setting_, *components_, *executors_,
                                                    *lifecycle_, *watch_)) {
  make_components(*setting_, *components_);
  chains_ = make_chains(*setting_, *components_);
  setting_->throw_errors();
  assign(*setting_, *components_);
  executors_->make_all();
  if (!description.modes.empty()) prepare_modes(*setting_, *components_, *executors_);
  if (!overrides.mode.empty()) {
    setting_->modes->begin_in(overrides.mode);
    for (const auto& loaded : components_->all())
      setting_->modes->serve_as_in_force(loaded->node());
  }
  for (const auto& loaded : components_->all()) {
    try {
      executors_->place(*loaded);
    } catch (const Error& error) {
      const ComponentDescription& component = loaded->description;
      setting_->errors.push_back(
          Error(fmt::format("component '{}': {}", component.name, error.what()), "",
                component.where)
              .what());
    }
  }
  setting_->throw_errors();
  if (overrides.executor.empty()) {  // else a comparison shows which type is overloaded
    for (std::string& error : guarantees_->too_much()) setting_->errors.push_back(std::move(error));
    check_listed_callbacks(*setting_, *components_, *executors_);
  }
  setting_->throw_errors();
  if (overrides.watches_bounds || description.watches_bounds)
    watch_->make(guarantees_->modelled(), components_->plan().chains);
  if (description.lifecycle) lifecycle_->make(*executors_);
  if (setting_->time_source != nullptr) services_->make(*this);
  for (const auto& loaded : components_->all()) {
    services_->serve(*loaded);
    lifecycle_->add(*loaded);
  }
  unloading_threads_ = std::make_unique<UnloadingThreads>(
      setting_->thread(kUnloadingThread), setting_->has_thread(kUnloadingThread)
                                              ? description.realtime
                                              : std::min(description.realtime, Realtime::prefer));
}

Container::~Container() {
  end_components();
  end_executors();
  unloading_threads_.reset();
  executors_.reset();    // first: it listens to nodes, which may belong to a user
  components_->clear();  // before the executors that run them
}

// ---- Life ----

void Container::start(std::function<void()> on_failure) {
  if (setting_->description.lock_memory)
    setting_->note(lock_memory(setting_->description.realtime));
  if (setting_->description.cpu_dma_latency_us) {
    dma_latency_.emplace(*setting_->description.cpu_dma_latency_us, setting_->description.realtime);
    setting_->note(dma_latency_->refused());
  }
  if (setting_->has_thread("log")) {
    Logger::instance().run_in_thread([&] {
      setting_->note(apply(setting_->thread("log"), setting_->description.realtime).refused);
    });
  }
  if (setting_->has_thread("main"))
    setting_->note(apply(setting_->thread("main"), setting_->description.realtime).refused);
  for (const auto& running : *running_) running->executor->release_timers(false);
  running_->start(
      setting_->description.realtime, *setting_->overrides.clock,
      [this](const FailedCallback& failed) { return services_->handle(failed); },
      std::move(on_failure));
  for (const auto& running : *running_) {
    if (running->is_own) running_->spin(*running);
  }
  for (const auto& loaded : components_->all()) executors_->begin(*loaded);
}

void Container::release() {
  watch_->begin();  // before the timers: the kernel may take 20 ms to begin its records
  // The constructors created the timers at different times; now all start together.
  for (const auto& loaded : components_->all()) {
    for (const auto& entity : loaded->node()->entities()) {
      if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
    }
  }
  if (setting_->overrides.slices != nullptr)
    setting_->overrides.slices->begin(Clock::steady().now());
  for (const auto& running : *running_) running->executor->release_timers(true);
  lifecycle_->bring_up();
  usage_->begin();
}

// In a simulation, callbacks may be in mid-execution: the clock must advance until they end,
// however long they take.
std::exception_ptr Container::end_executors() noexcept {
  cancel();
  if (setting_->is_simulated()) setting_->overrides.clock->as_manual()->advance(Nanoseconds::max());
  return running_->join();
}

void Container::end_components() noexcept {
  for (const auto& loaded : components_->all()) {
    if (const auto on_end = std::exchange(loaded->component->on_end, {})) on_end();
  }
}

TimePoint Container::watch_bounds() {
  return watch_->look_in_time();
}

void Container::check_matches() {
  const std::string hint = matches_->hint();
  if (!hint.empty() && !setting_->description.is_split_off) log(LogLevel::info, "{}", hint);
}

void Container::hold() {
  watch_->look();  // before the timers stop: afterwards, a waiting release counts as not taken
  for (const auto& chain : chains_) chain->end();
  for (const auto& running : *running_) {
    if (!running->is_own) running->executor->release_timers(false);
  }
  usage_->end();
  setting_->note(matches_->hint());
  for (const std::string& name : lifecycle_->unconfigured()) {
    setting_->note(
        fmt::format("lifecycle: '{}' is not configured; list it in `lifecycle: bring_up`, or use "
                    "`takt lifecycle set`",
                    name));
  }
}

std::size_t Container::pending() const noexcept {
  return running_->pending();
}

void Container::shut_down() {
  lifecycle_->shut_down();
}

void Container::stop() {
  if (!drain(*running_, *setting_)) {
    setting_->note(fmt::format("messages were still in transit {} s after the last timer",
                               kDrainLimit.count()));
  }
  if (!setting_->is_simulated()) lifecycle_->bring_down_rest(*unloading_threads_);
  end_components();
  const std::exception_ptr failure = end_executors();
  watch_->look(/*is_over=*/true);
  // A component that is being unloaded may complete and leave the list meanwhile.
  for (const auto& loaded : components_->all()) complete(*loaded, *setting_);
  if (failure != nullptr) std::rethrow_exception(failure);
}

void Container::cancel() noexcept {
  running_->cancel();
}

void Container::join() {
  if (!usage_->has_ended()) usage_->end();
  if (const auto failure = running_->join()) std::rethrow_exception(failure);
}

// ---- What it is made of ----

std::vector<LoadedComponent> Container::components() const {
  return components_->listed();
}

std::vector<std::string> Container::executor_names() const {
  return running_->names();
}

Plan Container::plan() const {
  return components_->plan();
}

const SystemDescription& Container::description() const noexcept {
  return setting_->description;
}

std::string Container::executor_of(const Node& node, const CallbackGroup& group) const {
  return executors_->name_for(node, group);
}

ModelledProcess Container::modelled() const {
  return guarantees_->modelled();
}

double Container::utilisation_of(const std::string& executor) const {
  return guarantees_->utilisation()[executor];
}

void Container::set_mode(const std::string& mode) {
  setting_->modes->want(mode);
  services_->switch_mode();
}

std::string Container::mode() const {
  return setting_->modes->in_force();
}

}  // namespace takt
