// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <future>
#include <unordered_map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>

#include "takt/base/logger.hpp"
#include "takt/containers/parameter_service.hpp"
#include "takt/sched/threads/memory_lock.hpp"

namespace takt {
namespace {

constexpr const char* kDefaultExecutor = "default";
constexpr const char* kServiceThread = "container";
constexpr const char* kLifecycleThread = "lifecycle";
constexpr const char* kLoaderThread = "loader";
constexpr auto kDrainLimit = std::chrono::seconds(5);
constexpr auto kShutDownLimit = std::chrono::seconds(10);

Nanoseconds process_cpu_time() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto time = [](const timeval& value) {
    return std::chrono::seconds(value.tv_sec) + std::chrono::microseconds(value.tv_usec);
  };
  return time(usage.ru_utime) + time(usage.ru_stime);
}

std::uint64_t proportional_set_size_kb() {
  std::ifstream file("/proc/self/smaps_rollup");
  for (std::string word; file >> word;) {
    if (word == "Pss:") {
      std::uint64_t kb = 0;
      file >> kb;
      return kb;
    }
  }
  return 0;
}

// Adds to, or takes from, the counters what the kernel has counted of a thread that is not ours.
void read_counters(ThreadStatistics& thread, int sign) {
  const std::string task = fmt::format("/proc/self/task/{}/", thread.in_force.tid);
  std::int64_t cpu_time_ns = 0;
  std::ifstream(task + "schedstat") >> cpu_time_ns;
  thread.cpu_time += sign * Nanoseconds(cpu_time_ns);
  std::ifstream status(task + "status");
  for (std::string word; status >> word;) {
    if (word != "voluntary_ctxt_switches:") continue;
    std::uint64_t switches = 0;
    status >> switches;
    thread.counters.voluntary_switches += static_cast<std::uint64_t>(sign) * switches;
  }
}

// Names that only the constructor has made: now it is known which exist.
void check_names(const ComponentDescription& component, const Node& node,
                 std::vector<std::string>& errors) {
  const auto add = [&](const SourceLine& where, std::string_view what, const std::string& name,
                       const std::string& what_to_do) {
    errors.push_back(Error(fmt::format("component '{}' has no {} '{}'", component.type, what, name),
                           what_to_do, where)
                         .what());
  };
  const auto line = [&](const auto& lines, const std::string& name) {
    const auto found = lines.find(name);
    return found != lines.end() ? found->second : component.where;
  };
  for (const std::string& name : node.unused_parameters()) {
    add(line(component.parameter_lines, name), "parameter", name, "");
  }
  for (const std::string& name : node.unused_remaps()) {
    add(line(component.remap_lines, name), "topic to remap", name, "");
  }
  for (const std::string& name : node.timers_of_one_name()) {
    errors.push_back(
        Error(fmt::format("component '{}' makes two timers called '{}'", component.type, name),
              "give each its own name in the code", component.where)
            .what());
  }
  const auto check = [&](const auto& described, const auto& objects, std::string_view what) {
    std::vector<std::string> names;
    for (const auto& object : objects) names.push_back(object->name());
    for (const auto& [name, description] : described) {
      if (std::find(names.begin(), names.end(), name) != names.end()) continue;
      add(description.where, what, name, suggest(name, names));
    }
  };
  check(component.callback_groups, node.groups(), "callback group");
  check(component.callbacks, node.entities(), "callback");
}

// Before executors have the callbacks, so that nothing has to be changed there.
void set_parameters(const ComponentDescription& component, Node& node,
                    std::vector<std::string>& errors) {
  CallbackParameterChanges changes;
  std::string where = component.where;
  for (const auto& [name, group] : component.callback_groups) {
    changes.callback_groups[name] = group.parameters;
    where = group.where;
  }
  for (const auto& [name, callback] : component.callbacks) {
    changes.callbacks[name] = callback.parameters;
    where = callback.where;
  }
  try {
    node.set_callback_parameters(changes);
  } catch (const Error& error) {
    errors.push_back(
        Error(fmt::format("component '{}': {}", component.type, error.what()), "", where).what());
  }
}

}  // namespace

struct Container::RunningExecutor {
  std::string name;
  std::unique_ptr<Executor> executor;
  bool is_own = false;  // of the container: for services, and the lifecycle
  std::thread thread;
  std::exception_ptr exception;  // read when `failed`
  std::atomic<bool> failed{false};
};

struct Container::Loaded {
  std::uint64_t id = 0;
  ComponentDescription description;
  std::unique_ptr<Component> component;
  std::shared_ptr<void> services, heartbeat;  // of its node, on ours
  // Guarded by mutex_.
  bool is_leaving = false;
  bool has_failed = false;  // and has to be taken from its executors

  std::mutex displacing;
  bool is_displaced = false;
  bool is_complete = false;

  const std::shared_ptr<Node>& node() const noexcept { return component->node; }
  bool uses_sim_time() const {
    const auto found = description.parameters.find(kUseSimTime);
    return found != description.parameters.end() && found->second == ParameterValue(true);
  }
  /// Where the description puts this group apart from the rest of its node; else empty.
  std::string own_executor(const CallbackGroup& group) const {
    const auto found = description.callback_groups.find(group.name());
    return found != description.callback_groups.end() ? found->second.executor : "";
  }
};

/// Threads that wait for the callbacks of unloaded components: one, and one more for each that
/// still waits. They stay, because to make and end a thread is work that the kernel does not
/// interrupt while memory is locked.
class Container::Loaders {
 public:
  Loaders(ThreadAttributes attributes, Realtime realtime)
      : attributes_(std::move(attributes)), realtime_(realtime) {}
  ~Loaders() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    for (std::thread& loader : threads_) loader.join();
  }
  Loaders(const Loaders&) = delete;
  Loaders& operator=(const Loaders&) = delete;

  /// The result is there when the thread is free again.
  std::future<void> run(std::function<void()> work) {
    Task task{std::move(work), {}};
    std::future<void> done = task.done.get_future();
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
      if (threads_.size() < ++unfinished_) threads_.emplace_back([this] { serve(); });
    }
    changed_.notify_one();
    return done;
  }

 private:
  struct Task {
    std::function<void()> work;
    std::promise<void> done;
  };

  void serve() {
    apply(attributes_, realtime_);
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return is_over_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      Task task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      std::exception_ptr exception;
      try {
        task.work();
      } catch (...) {
        exception = std::current_exception();
      }
      task.work = nullptr;
      lock.lock();
      --unfinished_;
      if (exception != nullptr) {
        task.done.set_exception(exception);
      } else {
        task.done.set_value();
      }
    }
  }

  const ThreadAttributes attributes_;
  const Realtime realtime_;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<Task> tasks_;
  std::size_t unfinished_ = 0;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

Container::Container(const SystemDescription& description, const ContainerOverrides& overrides)
    : description_(description), overrides_(overrides), notes_(description.notes) {
  if (description_.dds) {
    DdsOptions options = *description_.dds;
    options.realtime = description_.realtime;
    participant_ =
        overrides_.participant != nullptr ? overrides_.participant : Participant::create(options);
    for (const ThreadState& thread : participant_->threads()) {
      if (!thread.refused.empty()) notes_.push_back(thread.refused);
      dds_threads_.push_back({.asked = options.threads, .in_force = thread});
    }
  }
  make_components();
  make_chains();
  if (!errors_.empty()) throw ConfigurationError(errors_);
  assign();
  if (has_thread("watchdog")) {
    watchdog_ =
        std::make_shared<Watchdog>(thread("watchdog"), description_.realtime, *overrides_.clock);
    if (!watchdog_->state().refused.empty()) notes_.push_back(watchdog_->state().refused);
  }
  make_executors();
  place_components();
  if (!errors_.empty()) throw ConfigurationError(errors_);
  const auto may_be_removed = [](const auto& loaded) {
    return loaded->description.on_exception == OnException::remove_node;
  };
  if (description_.lifecycle) make_lifecycle();
  const auto uses_sim_time = [](const auto& loaded) { return loaded->uses_sim_time(); };
  if ((participant_ != nullptr && !description_.is_split_off) || has_thread(kServiceThread) ||
      description_.lifecycle ||
      std::any_of(components_.begin(), components_.end(), may_be_removed) ||
      std::any_of(components_.begin(), components_.end(), uses_sim_time)) {
    make_manager();
  }
  for (const auto& loaded : components_) serve(*loaded);
}

Container::~Container() {
  for (const auto& running : executors_) {
    if (!running->thread.joinable()) continue;
    running->executor->cancel();
    running->thread.join();
  }
  loaders_.reset();
  // Components go while their executors still exist, in the reverse order of their making.
  while (!components_.empty()) components_.pop_back();
}

bool Container::has_thread(const std::string& name) const {
  return std::any_of(description_.threads.begin(), description_.threads.end(),
                     [&](const auto& entry) { return entry.attributes.name == name; });
}

ThreadAttributes Container::thread(const std::string& name) const {
  const auto found = std::find_if(description_.threads.begin(), description_.threads.end(),
                                  [&](const auto& entry) { return entry.attributes.name == name; });
  return found != description_.threads.end() ? found->attributes : ThreadAttributes{.name = name};
}

void Container::make_executors() {
  const auto make = [this](const ExecutorDescription& executor) {
    ExecutorOptions options;
    options.name = executor.name;
    options.scheduler = overrides_.scheduler.empty() ? executor.scheduler : overrides_.scheduler;
    options.wait = executor.wait;
    options.early_wake = executor.early_wake;
    options.per = executor.per;
    options.trigger = executor.trigger;
    options.order = executor.order;
    options.realtime = description_.realtime;
    options.statistics = overrides_.statistics;
    options.trace_events = overrides_.trace_events;
    options.watchdog = watchdog_;
    options.clock = overrides_.clock;
    const std::size_t most = executors().make(executor.type, options)->max_threads();
    for (const std::string& name : executor.threads) {
      if (options.threads.size() < most) options.threads.push_back(thread(name));
    }
    add(executor.name, executors().make(executor.type, options));
  };
  if (overrides_.executor.empty()) {
    for (const ExecutorDescription& executor : description_.executors) make(executor);
    const auto is_default = [](const auto& executor) { return executor.name == kDefaultExecutor; };
    if (std::none_of(description_.executors.begin(), description_.executors.end(), is_default) &&
        std::any_of(description_.components.begin(), description_.components.end(),
                    [](const auto& component) {
                      const auto is = [](const std::string& name) {
                        return name.empty() || name == kDefaultExecutor;
                      };
                      return is(component.executor) ||
                             std::any_of(component.callback_groups.begin(),
                                         component.callback_groups.end(), [](const auto& group) {
                                           return group.second.executor == kDefaultExecutor;
                                         });
                    })) {
      make({.name = kDefaultExecutor});
    }
    return;
  }
  // One executor for all, on the threads of the file in order of appearance, and then on assigned
  // ones.
  ExecutorDescription all{.name = overrides_.executor, .type = overrides_.executor};
  for (const ExecutorDescription& executor : description_.executors) {
    all.threads.insert(all.threads.end(), executor.threads.begin(), executor.threads.end());
  }
  make(all);
}

Container::RunningExecutor& Container::add(const std::string& name,
                                           std::unique_ptr<Executor> executor) {
  executors_.push_back(std::make_unique<RunningExecutor>());
  executors_.back()->name = name;
  executors_.back()->executor = std::move(executor);
  return *executors_.back();
}

Executor& Container::executor_for(const std::string& name) {
  if (!overrides_.executor.empty()) return *executors_.front()->executor;
  const std::string& wanted = name.empty() ? kDefaultExecutor : name;
  const auto found = std::find_if(executors_.begin(), executors_.end(),
                                  [&](const auto& running) { return running->name == wanted; });
  return *(*found)->executor;  // the reader, or load, has checked the name
}

std::vector<std::string> Container::executor_names() const {
  std::vector<std::string> names;
  for (const auto& running : executors_) {
    if (!running->is_own) names.push_back(running->name);
  }
  return names;
}

// ---- Components ----

void Container::make_components() {
  for (const ComponentDescription& component : description_.components) {
    if (auto loaded = make(component, errors_)) {
      loaded->id = ++last_id_;
      components_.push_back(std::move(loaded));
    }
  }
  if (!components_.empty() && errors_.empty()) check_topics();
  for (std::string& error : name_conflicts(components())) errors_.push_back(std::move(error));
}

// What the file decides about topics: of those that are there.
void Container::check_topics() {
  std::vector<std::string> names;
  for (const auto& loaded : components_) {
    for (std::string& name : loaded->node()->topics()) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (const auto& [name, where] : description_.topic_lines) {
    if (std::binary_search(names.begin(), names.end(), name)) continue;
    errors_.push_back(
        Error(fmt::format("no component has the topic '{}'", name), suggest(name, names), where)
            .what());
  }
}

std::unique_ptr<Component> Container::construct(const ComponentDescription& component,
                                                const NodeOptions& options) const {
  if (!overrides_.on_making) return takt::components().make(component.type, options);
  struct Told {
    const std::function<void(std::string_view)>& tell;
    ~Told() { tell(""); }
  };
  overrides_.on_making(component.name.empty() ? component.type : component.name);
  const Told told{overrides_.on_making};
  return takt::components().make(component.type, options);
}

// nullptr, and errors, when it cannot be made as described.
std::shared_ptr<Container::Loaded> Container::make(const ComponentDescription& component,
                                                   Errors& errors) const {
  NodeOptions options;
  options.name = component.name;
  options.name_space = component.name_space;
  options.parameters = component.parameters;
  options.remap = component.remap;
  options.qos = description_.topics;
  options.log_level = component.log_level;
  options.participant = participant_;
  auto loaded = std::make_shared<Loaded>();
  loaded->description = component;
  options.clock = loaded->uses_sim_time() ? &simulated_clock_ : overrides_.clock;
  const std::size_t before = errors.size();
  const auto failed = [&](std::string_view why) {
    errors.push_back(Error(fmt::format("component '{}' could not be made: {}", component.type, why),
                           "", component.where)
                         .what());
  };
  try {
    loaded->component = construct(component, options);
    check_names(component, *loaded->node(), errors);
    if (errors.size() == before) set_parameters(component, *loaded->node(), errors);
  } catch (const std::exception& error) {
    failed(error.what());
  } catch (...) {
    failed("it threw no std::exception");
  }
  return errors.size() == before ? loaded : nullptr;
}

LoadedComponent Container::load(ComponentDescription component) {
  find_component(component.type, component.library);
  const std::vector<std::string> names = executor_names();
  const auto exists = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto check = [&](const std::string& name) {
    if (exists(name)) return;
    throw Error(fmt::format("no executor is called '{}'", name),
                names.empty() ? "describe one under 'executors'" : suggest(name, names),
                component.where);
  };
  if (component.executor.empty()) {
    component.executor =
        exists(kDefaultExecutor) || names.empty() ? kDefaultExecutor : names.front();
  }
  check(component.executor);
  for (const auto& [name, group] : component.callback_groups) {
    if (!group.executor.empty()) check(group.executor);
  }
  if (component.on_exception == OnException::remove_node && failed_ == nullptr) {
    throw Error("'on_exception: remove_node' needs a thread that does it",
                "add a thread called 'container'", component.where);
  }
  Errors errors;
  const std::shared_ptr<Loaded> loaded = make(component, errors);
  if (loaded == nullptr) throw ConfigurationError(errors);
  const std::shared_ptr<Node>& node = loaded->node();
  {
    const std::lock_guard lock(mutex_);
    if (const auto other = find(node->fully_qualified_name())) {
      throw Error(fmt::format("component {} is called '{}' already", other->id,
                              node->fully_qualified_name()),
                  other->is_leaving ? "it is being unloaded; wait" : "give each its own name");
    }
    const std::vector<ChainBound> before = bounds();
    components_.push_back(loaded);
    for (const auto& entity : node->entities()) {
      Nanoseconds period = entity->period();
      if (period == Nanoseconds::zero()) {
        period = node->callback_parameters(*entity).period.value_or(period);
      }
      plan_.callbacks.push_back({.node = node, .entity = entity, .period = period});
    }
    errors = too_much_for_executors();
    const std::vector<ChainBound> after = bounds();
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (after[i].bound <= after[i].deadline || before[i].bound > before[i].deadline) continue;
      errors.push_back(fmt::format(
          "with '{}', chain '{}' could take {}, and its deadline is {}; without, {}; give it "
          "another executor, less priority, or a smaller budget",
          node->fully_qualified_name(), after[i].chain,
          after[i].bound == Nanoseconds::max() ? "for ever" : to_string(after[i].bound),
          to_string(after[i].deadline), to_string(before[i].bound)));
    }
    if (!errors.empty()) {
      forget(*loaded);
      throw ConfigurationError(errors);
    }
    loaded->id = ++last_id_;
  }
  for (const auto& entity : node->entities()) {
    // It was made long ago.
    if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
  }
  try {
    place(*loaded);
    serve(*loaded);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    forget(*loaded);
    throw;
  }
  return {loaded->id, node->fully_qualified_name(), component.type, component.where};
}

// With the mutex held; nullptr when there is none.
std::shared_ptr<Container::Loaded> Container::find(std::string_view name) const {
  const auto found = std::find_if(components_.begin(), components_.end(), [&](const auto& loaded) {
    return loaded->node()->fully_qualified_name() == name;
  });
  return found != components_.end() ? *found : nullptr;
}

// With the mutex held.
void Container::forget(const Loaded& loaded) {
  std::erase_if(plan_.callbacks, [&](const auto& entry) { return entry.node == loaded.node(); });
  std::erase_if(components_, [&](const auto& entry) { return entry.get() == &loaded; });
}

void Container::unload(std::uint64_t id, Nanoseconds limit) {
  std::shared_ptr<Loaded> loaded;
  {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> ids;
    for (const auto& candidate : components_) {
      if (candidate->id == id) loaded = candidate;
      ids.push_back(std::to_string(candidate->id));
    }
    if (loaded == nullptr) {
      throw Error(fmt::format("there is no component {}", id),
                  ids.empty() ? "none is loaded" : fmt::format("loaded: {}", fmt::join(ids, ", ")));
    }
    if (std::exchange(loaded->is_leaving, true)) {
      throw Error(fmt::format("component {} is being unloaded already", id),
                  "it goes when its callbacks have returned");
    }
  }
  // On this thread, as it may be the one that runs them.
  loaded->services.reset();
  loaded->heartbeat.reset();
  const std::string name = loaded->node()->fully_qualified_name();
  std::function<void()> work = [this, loaded]() mutable {
    try {
      displace(*loaded);
    } catch (...) {
      serve(*loaded);  // it stays, and so do its services
      const std::lock_guard lock(mutex_);
      loaded->is_leaving = false;
      throw;
    }
    complete(*loaded);
    {
      const std::lock_guard lock(mutex_);
      forget(*loaded);
    }
    loaded.reset();  // the component goes
  };
  loaded.reset();
  if (loaders_ == nullptr) {
    const Realtime realtime = has_thread(kLoaderThread)
                                  ? description_.realtime
                                  : std::min(description_.realtime, Realtime::prefer);
    loaders_ = std::make_unique<Loaders>(thread(kLoaderThread), realtime);
  }
  std::future<void> done = loaders_->run(std::move(work));
  if (done.wait_for(limit) == std::future_status::timeout) {
    throw Error(
        fmt::format("component {} '{}' still runs a callback after {}", id, name, to_string(limit)),
        "it goes when that returns");
  }
  done.get();
}

std::vector<LoadedComponent> Container::components() const {
  const std::lock_guard lock(mutex_);
  std::vector<LoadedComponent> result;
  for (const auto& loaded : components_) {
    if (loaded->is_leaving) continue;
    result.push_back({loaded->id, loaded->node()->fully_qualified_name(), loaded->description.type,
                      loaded->description.where});
  }
  return result;
}

void Container::make_chains() {
  if (!errors_.empty()) return;
  std::vector<std::shared_ptr<Node>> nodes;
  for (const auto& loaded : components_) nodes.push_back(loaded->node());
  plan_ = make_plan(find_chains(description_, nodes, errors_), nodes);
  for (const PlannedChain& chain : plan_.chains) {
    chains_.push_back(Chain::create(chain.options, chain.path));
  }
}

// What the file leaves open is as Takt assigns it.
void Container::assign() {
  for (const Plan::Callback& callback : plan_.callbacks) {
    if (callback.priority == 0 || callback.node->callback_parameters(*callback.entity).priority) {
      continue;
    }
    callback.node->set_callback_parameters(
        {.callbacks = {{callback.entity->name(), {.priority = callback.priority}}}});
  }
  for (const Plan::Executor& executor : plan_.executors) {
    if (!has_thread(executor.name)) description_.threads.push_back({executor.thread, {}});
    const auto is_namesake = [&](const auto& known) { return known.name == executor.name; };
    if (std::none_of(description_.executors.begin(), description_.executors.end(), is_namesake)) {
      description_.executors.push_back(
          {.name = executor.name, .type = "chain_aware", .threads = {executor.name}});
    }
  }
  std::unordered_map<const Node*, ComponentDescription*> unassigned;
  for (const auto& loaded : components_) {
    if (loaded->description.executor.empty())
      unassigned[loaded->node().get()] = &loaded->description;
  }
  for (const Plan::Callback& callback : plan_.callbacks) {
    const auto component = unassigned.find(callback.node.get());
    if (component == unassigned.end() || callback.executor.empty()) continue;
    std::string& executor =
        component->second->callback_groups[callback.entity->group()->name()].executor;
    if (executor.empty()) executor = callback.executor;
  }
}

void Container::place_components() {
  for (const auto& loaded : components_) place(*loaded);
  if (!overrides_.executor.empty()) return;
  for (std::string& error : too_much_for_executors()) errors_.push_back(std::move(error));
  check_listed_callbacks();
}

// What executors name: callbacks that they have.
void Container::check_listed_callbacks() {
  for (const ExecutorDescription& executor : description_.executors) {
    std::vector<std::string> listed = executor.order;
    if (!executor.trigger.one.empty()) listed.push_back(executor.trigger.one);
    if (listed.empty()) continue;
    std::vector<std::string> names;
    for (const Plan::Callback& callback : plan_.callbacks) {
      if (executor_of(*callback.node, *callback.entity->group()) != executor.name) continue;
      names.push_back(to_string(Chain::Step{callback.node, callback.entity->name()}).substr(1));
    }
    for (const std::string& name : listed) {
      const std::string wanted = name.starts_with('/') ? name.substr(1) : name;
      if (std::find(names.begin(), names.end(), wanted) != names.end()) continue;
      errors_.push_back(fmt::format("{}: executor '{}' has no callback '{}'; {}", executor.where,
                                    executor.name, name, suggest(wanted, names)));
    }
  }
}

std::string Container::executor_of(const Node& node, const CallbackGroup& group) const {
  if (!overrides_.executor.empty()) return overrides_.executor;
  for (const auto& loaded : components_) {
    if (loaded->node().get() != &node) continue;
    const std::string own = loaded->own_executor(group);
    if (!own.empty()) return own;
    if (!loaded->description.executor.empty()) return loaded->description.executor;
  }
  return kDefaultExecutor;
}

double Container::utilisation_of(const std::string& executor) const {
  double utilisation = 0;
  for (const Plan::Callback& callback : plan_.callbacks) {
    const auto budget = callback.node->callback_parameters(*callback.entity).budget;
    if (!budget || callback.period == Nanoseconds::zero() ||
        executor_of(*callback.node, *callback.entity->group()) != executor) {
      continue;
    }
    utilisation +=
        static_cast<double>(budget->count()) / static_cast<double>(callback.period.count());
  }
  return utilisation;
}

// Of CPUs: a thread is one, a reserved one what it has reserved.
double Container::capacity_of(const ExecutorDescription& executor) const {
  if (executor.threads.empty()) return 1;
  double capacity = 0;
  for (const std::string& name : executor.threads) {
    const ThreadAttributes attributes = thread(name);
    capacity += attributes.policy != ThreadPolicy::deadline
                    ? 1
                    : static_cast<double>(attributes.runtime.count()) /
                          static_cast<double>(attributes.period.count());
  }
  return capacity;
}

std::vector<ChainBound> Container::bounds() const {
  return chain_bounds(plan_, [this](const Plan::Callback& callback) {
    Placement placement{executor_of(*callback.node, *callback.entity->group())};
    for (const ExecutorDescription& executor : description_.executors) {
      if (executor.name != placement.executor) continue;
      placement.is_by_priority = executor.scheduler == "fixed_priority" ||
                                 executor.scheduler == "chain_priority" ||
                                 (executor.scheduler.empty() && executor.type == "chain_aware");
    }
    return placement;
  });
}

// An executor whose callbacks need more time than its threads have cannot serve them, whatever its
// order.
Container::Errors Container::too_much_for_executors() const {
  Errors errors;
  for (const ExecutorDescription& executor : description_.executors) {
    if (executor.type == "isolated") continue;  // a thread each
    const double capacity = capacity_of(executor);
    const double utilisation = utilisation_of(executor.name);
    if (utilisation <= capacity) continue;
    errors.push_back(fmt::format(
        "{}: the budgets of the callbacks of executor '{}' are {:.0f} % of its {}; give some of "
        "them to another executor, or lower their rates",
        executor.where.empty() ? description_.file : executor.where, executor.name,
        100 * utilisation / capacity,
        capacity < 1 || capacity != std::floor(capacity) ? "reservation"
        : executor.threads.size() > 1 ? fmt::format("{} threads", executor.threads.size())
                                      : "1 thread"));
  }
  return errors;
}

// A process may be called anything, a node not.
std::string Container::own_name(const char* ending) const {
  std::string name = description_.name + ending;
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char character) { return std::isalnum(character) == 0; }, '_');
  if (std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(0, "_");
  return name;
}

// What is the container's own allocates, and must not be in the way of the components.
void Container::make_own_executor(const char* name, const std::shared_ptr<Node>& node) {
  RunningExecutor& running =
      add(name, executors().make("events", {.name = name,
                                            .threads = {thread(name)},
                                            .realtime = description_.realtime,
                                            .statistics = StatisticsLevel::off,
                                            .clock = overrides_.clock}));
  running.is_own = true;
  running.executor->add_node(node);
}

void Container::make_manager() {
  service_node_ = std::make_shared<Node>(
      own_name(""), NodeOptions{.clock = overrides_.clock, .participant = participant_});
  manager_ = std::make_unique<ComponentManager>(
      *this, service_node_, load_policy(description_),
      description_.dds && description_.dds->parameter_services && !description_.is_split_off);
  if (participant_ != nullptr && description_.dds->rosout && !description_.is_split_off) {
    rosout_ = std::make_unique<Rosout>(*service_node_);
  }
  failed_ = service_node_->create_guard_condition("failed", [this] { displace_failed(); });
  make_own_executor(kServiceThread, service_node_);
}

// On a thread that no callback of a transition holds up: heartbeats tell that the process lives.
void Container::make_lifecycle() {
  const LifecycleDescription& lifecycle = *description_.lifecycle;
  lifecycle_node_ = std::make_shared<Node>(
      own_name("_lifecycle"), NodeOptions{.clock = overrides_.clock, .participant = participant_});
  heartbeats_ = std::make_unique<HeartbeatSender>(*lifecycle_node_, lifecycle.heartbeat);
  if (lifecycle.manager.empty() || lifecycle.manager == description_.name) {
    lifecycle_ = std::make_unique<LifecycleManager>(*lifecycle_node_, lifecycle);
  }
  for (const auto& loaded : components_) {
    const std::string& name = loaded->node()->fully_qualified_name();
    const bool is_managed = std::any_of(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                        [&](const auto& managed) { return managed.name == name; });
    if (!is_managed || std::dynamic_pointer_cast<LifecycleNode>(loaded->node())) continue;
    errors_.push_back(
        fmt::format("{}: '{}' has no lifecycle; derive '{}' from LifecycleNode, or "
                    "leave it out of 'bring_up'",
                    lifecycle.where, name, loaded->description.type));
  }
  if (!errors_.empty()) throw ConfigurationError(errors_);
  make_own_executor(kLifecycleThread, lifecycle_node_);
}

void Container::serve(Loaded& loaded) {
  if (manager_ != nullptr) loaded.services = manager_->serve(loaded.node());
  if (loaded.uses_sim_time() && time_source_ == nullptr) {
    time_source_ = std::make_unique<TimeSource>(*service_node_, simulated_clock_);
  }
  const auto node = std::dynamic_pointer_cast<LifecycleNode>(loaded.node());
  if (heartbeats_ != nullptr && node != nullptr) loaded.heartbeat = heartbeats_->tell(node);
}

void Container::change_parameters(const std::string& text) {
  std::vector<std::pair<std::shared_ptr<Node>, CallbackParameterChanges>> changes;
  std::vector<std::string> names;
  for (const LoadedComponent& component : components()) names.push_back(component.name);
  for (auto& [name, of_node] : read_parameter_changes(text)) {
    const std::string full = name.starts_with('/') ? name : "/" + name;
    const std::lock_guard lock(mutex_);
    const auto loaded = find(full);
    if (loaded == nullptr) {
      throw Error(fmt::format("no component is called '{}'", full), suggest(full, names));
    }
    loaded->node()->check_callback_parameters(of_node);
    changes.emplace_back(loaded->node(), std::move(of_node));
  }
  for (const auto& [node, of_node] : changes) node->set_callback_parameters(of_node);
}

void Container::place(const Loaded& loaded) {
  const std::shared_ptr<Node>& node = loaded.node();
  for (const auto& group : node->groups()) {
    const std::string own = loaded.own_executor(*group);
    if (own.empty()) continue;
    if (overrides_.executor.empty()) {
      executor_for(own).add_callback_group(group, node);
      continue;
    }
    const SourceLine& where = loaded.description.callback_groups.at(group->name()).where;
    if (where.empty()) continue;  // assigned, not asked for
    notes_.push_back(
        fmt::format("{}: callback group '{}' of '{}' is under --executor {}, not under '{}'", where,
                    group->name(), node->name(), overrides_.executor, own));
  }
  executor_for(loaded.description.executor).add_node(node);
}

// What place has done, undone; waits for running callbacks.
void Container::displace(Loaded& loaded) {
  const std::lock_guard once(loaded.displacing);
  if (loaded.is_displaced) return;
  const std::shared_ptr<Node>& node = loaded.node();
  std::vector<std::shared_ptr<CallbackGroup>> removed;
  try {
    for (const auto& group : node->groups()) {
      const std::string own = loaded.own_executor(*group);
      if (own.empty() || !overrides_.executor.empty()) continue;
      executor_for(own).remove_callback_group(group, node);
      removed.push_back(group);
    }
    executor_for(loaded.description.executor).remove_node(node);
  } catch (...) {  // one of them refuses: it stays as it was
    for (const auto& group : removed) {
      executor_for(loaded.own_executor(*group)).add_callback_group(group, node);
    }
    throw;
  }
  loaded.is_displaced = true;
}

// ---- Exceptions ----

// On the thread of the callback.
bool Container::handle(const FailedCallback& failed) {
  std::string what = "something that is no std::exception";
  try {
    std::rethrow_exception(failed.exception);
  } catch (const std::exception& error) {
    what = error.what();
  } catch (...) {
  }
  OnException policy = OnException::terminate;
  const auto is_own = [&](const std::shared_ptr<Node>& node) {
    return node != nullptr && failed.node == node->fully_qualified_name();
  };
  if (is_own(service_node_) || is_own(lifecycle_node_)) {
    policy = OnException::ignore;  // a user's code inside a service: its caller gets no answer
  } else {
    const std::lock_guard lock(mutex_);
    if (const auto loaded = find(failed.node)) {
      policy = loaded->description.on_exception;
      loaded->has_failed = policy == OnException::remove_node;
    }
  }
  log(LogLevel::error, "{}{}{} threw: {}; {}", failed.node,
      failed.callback.starts_with('/') ? "" : "/", failed.callback, what,
      policy == OnException::terminate     ? "the container ends"
      : policy == OnException::remove_node ? "its node is taken from its executors"
                                           : "it goes on");
  if (policy == OnException::remove_node) failed_->trigger();
  return policy != OnException::terminate;
}

// Not on the thread of the callback: two of one node that fail at the same time would wait for each
// other.
void Container::displace_failed() {
  std::vector<std::shared_ptr<Loaded>> failed;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& loaded : components_) {
      if (std::exchange(loaded->has_failed, false)) failed.push_back(loaded);
    }
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
  const auto note = [this](const std::string& refused) {
    if (!refused.empty()) notes_.push_back(refused);
  };
  if (description_.lock_memory) note(lock_memory(description_.realtime));
  if (description_.cpu_dma_latency_us) {
    dma_latency_.emplace(*description_.cpu_dma_latency_us, description_.realtime);
    note(dma_latency_->refused());
  }
  // A log thread without its attributes is no reason to stop.
  if (has_thread("log")) {
    Logger::instance().run_in_thread([&] {
      note(apply(thread("log"), std::min(description_.realtime, Realtime::prefer)).refused);
    });
  }
  if (has_thread("main")) note(apply(thread("main"), description_.realtime).refused);
  for (const auto& running : executors_) {
    running->executor->release_timers(false);
    running->thread = std::thread([this, &executor = *running, on_failure] {
      try {
        // Not what this thread has; what the file gives comes on top.
        apply({.name = executor.name}, std::min(description_.realtime, Realtime::prefer));
        executor.executor->spin([this](const FailedCallback& failed) { return handle(failed); });
      } catch (...) {
        executor.exception = std::current_exception();
        executor.failed.store(true);
        if (on_failure) on_failure();
      }
    });
  }
  for (const auto& running : executors_) {
    while (!running->executor->is_spinning() && !running->failed.load()) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }
}

void Container::release() {
  // Timers were made one by one, some time ago; now that all threads are there, they start
  // together.
  {
    const std::lock_guard lock(mutex_);
    for (const auto& loaded : components_) {
      for (const auto& entity : loaded->node()->entities()) {
        if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
      }
    }
  }
  for (const auto& running : executors_) running->executor->release_timers(true);
  if (lifecycle_ != nullptr) lifecycle_->bring_up();
  released_ = Clock::steady().now();
  cpu_time_ = process_cpu_time();
  for (ThreadStatistics& thread : dds_threads_) read_counters(thread, -1);
}

std::size_t Container::pending() const noexcept {
  std::size_t count = 0;
  for (const auto& running : executors_) {
    // Its own are never done: there are heartbeats.
    if (!running->failed.load() && !running->is_own) count += running->executor->pending();
  }
  return count;
}

// All is served when nothing was pending for several looks in a row: a message that goes from one
// executor to the next can escape one look, but not all.
bool Container::drain() {
  const TimePoint limit = Clock::steady().now() + kDrainLimit;
  for (int quiet = 0; quiet < 5; ++quiet) {
    if (pending() != 0) quiet = -1;
    if (Clock::steady().now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

void Container::check_matches() {
  std::vector<OneSidedTopic> topics = one_sided_topics(participant_.get());
  require_matches(topics);
  std::erase_if(topics, [this](const OneSidedTopic& topic) {
    return description_.must_match.contains(topic.name);  // an error has said it
  });
  const std::string hint = hint_at(topics);
  if (!hint.empty() && !description_.is_split_off) log(LogLevel::info, "{}", hint);
}

void Container::require_matches(const std::vector<OneSidedTopic>& topics) {
  has_checked_matches_ = true;
  for (const OneSidedTopic& topic : topics) {
    const auto required = description_.must_match.find(topic.name);
    if (required == description_.must_match.end()) continue;
    std::string error = Error(fmt::format("topic '{}' must match: {}", topic.name, topic.reason()),
                              "", required->second)
                            .what();
    log(LogLevel::error, "{}", error);
    const std::lock_guard lock(mutex_);
    failures_.push_back(std::move(error));
  }
}

void Container::hold() {
  for (const auto& running : executors_) {
    if (!running->is_own) running->executor->release_timers(false);
  }
  held_ = Clock::steady().now();
  cpu_time_ = process_cpu_time() - cpu_time_;
  pss_kb_ = proportional_set_size_kb();
  for (ThreadStatistics& thread : dds_threads_) {
    thread.in_force = thread_state(thread.in_force.tid);  // by now Cyclone has named it
    read_counters(thread, 1);
    thread.wall_time = held_ - released_;
  }
  if (!has_checked_matches_ && !description_.must_match.empty()) {
    require_matches(one_sided_topics(participant_.get()));
  }
}

std::vector<EndpointState> Container::endpoints() const {
  if (participant_ == nullptr) return {};
  std::vector<EndpointState> endpoints = participant_->endpoints();
  std::erase_if(endpoints, [](const EndpointState& endpoint) {  // the container's own
    return endpoint.is_writer &&
           (endpoint.topic == "/rosout" || endpoint.topic == "/parameter_events");
  });
  return endpoints;
}

void Container::shut_down() {
  if (lifecycle_ == nullptr) return;
  for (const std::string& name : lifecycle_->shut_down(kShutDownLimit)) {
    notes_.push_back(fmt::format("lifecycle: {} was not shut down", name));
  }
}

void Container::stop() {
  if (!drain()) {
    notes_.push_back(fmt::format("messages were still under way {} s after the last timer",
                                 kDrainLimit.count()));
  }
  for (const auto& running : executors_) running->executor->cancel();
  for (const auto& running : executors_) {
    if (running->thread.joinable()) running->thread.join();
  }
  for (const auto& loaded : components_) complete(*loaded);
  for (const auto& running : executors_) {
    if (running->exception != nullptr) std::rethrow_exception(running->exception);
  }
}

// None of its callbacks runs any more.
void Container::complete(Loaded& loaded) {
  if (std::exchange(loaded.is_complete, true)) return;
  auto* const completing = dynamic_cast<Completing*>(loaded.node().get());
  std::string failure = completing != nullptr ? completing->complete() : "";
  if (failure.empty()) return;
  const std::lock_guard lock(mutex_);
  failures_.push_back(fmt::format("{}: {}", loaded.node()->fully_qualified_name(), failure));
}

ProcessResult Container::result() const {
  ProcessResult result;
  result.name = description_.name;
  result.notes = notes_;
  {
    const std::lock_guard lock(mutex_);
    result.failures = failures_;
  }
  for (const auto& chain : chains_) {
    result.chains.push_back(
        {chain->options().name, chain->options().deadline, chain->statistics()});
  }
  const Nanoseconds wall = held_ - released_;
  result.duration_s = std::chrono::duration<double>(wall).count();
  result.cpu_percent = 100.0 * static_cast<double>(cpu_time_.count()) /
                       static_cast<double>(std::max<std::int64_t>(wall.count(), 1));
  result.pss_kb = pss_kb_;
  result.allocations_counted = allocations_are_counted();
  for (const auto& running : executors_) {
    std::vector<CallbackStatistics> callbacks = running->executor->statistics();
    if (callbacks.empty()) continue;  // the default executor, unused
    if (running->is_own) callbacks.clear();
    result.callbacks.reserve(result.callbacks.size() + callbacks.size());
    for (auto& callback : callbacks) {
      result.callbacks.push_back({running->name, std::move(callback)});
    }
    for (auto& statistics : running->executor->thread_statistics()) {
      if (!running->is_own) {
        result.allocations_while_spinning += statistics.counters.allocations;
        result.allocations_in_dds += statistics.counters.foreign_allocations;
      }
      if (statistics.missed_periods + statistics.dropped_outputs != 0) {
        result.notes.push_back(fmt::format(
            "executor '{}' missed {} of its periods, and dropped {} messages that did not fit into "
            "one",
            running->name, statistics.missed_periods, statistics.dropped_outputs));
      }
      if (!statistics.in_force.refused.empty()) result.notes.push_back(statistics.in_force.refused);
      result.threads.push_back({running->name, std::move(statistics)});
    }
  }
  for (const ThreadStatistics& thread : dds_threads_) result.threads.push_back({"dds", thread});
  if (participant_ != nullptr && dds_warnings() != 0) {
    result.notes.push_back(fmt::format("Cyclone DDS has warned {} times", dds_warnings()));
  }
  return result;
}

}  // namespace takt
