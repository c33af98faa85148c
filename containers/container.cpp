// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/base/logger.hpp"
#include "takt/sched/memory_lock.hpp"

namespace takt {
namespace {

constexpr const char* kDefaultExecutor = "default";
constexpr auto kDrainLimit = std::chrono::seconds(5);

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

}  // namespace

struct Container::RunningExecutor {
  std::string name;
  std::unique_ptr<Executor> executor;
  std::thread thread;
  std::exception_ptr exception;  // read when `failed`
  std::atomic<bool> failed{false};
};

Container::Container(const SystemDescription& description, const ContainerOverrides& overrides)
    : description_(description), overrides_(overrides), notes_(description.notes) {
  make_executors();
  make_components();
}

Container::~Container() {
  for (const auto& running : executors_) {
    if (!running->thread.joinable()) continue;
    running->executor->cancel();
    running->thread.join();
  }
  // Components go while their executors still exist, in the reverse order of their making.
  while (!components_.empty()) components_.pop_back();
  if (dma_latency_file_ >= 0) close(dma_latency_file_);
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
    options.realtime = description_.realtime;
    options.statistics = overrides_.statistics;
    const std::size_t most = executors().make(executor.type, options)->max_threads();
    for (const std::string& name : executor.threads) {
      if (options.threads.size() < most) options.threads.push_back(thread(name));
    }
    auto running = std::make_unique<RunningExecutor>();
    running->name = executor.name;
    running->executor = executors().make(executor.type, options);
    executors_.push_back(std::move(running));
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
  // One executor for all, on the threads of the file in order of appearance.
  ExecutorDescription all{.name = overrides_.executor, .type = overrides_.executor};
  for (const ExecutorDescription& executor : description_.executors) {
    all.threads.insert(all.threads.end(), executor.threads.begin(), executor.threads.end());
  }
  make(all);
}

Executor& Container::executor_for(const std::string& name) {
  if (!overrides_.executor.empty()) return *executors_.front()->executor;
  const std::string& wanted = name.empty() ? kDefaultExecutor : name;
  const auto found = std::find_if(executors_.begin(), executors_.end(),
                                  [&](const auto& running) { return running->name == wanted; });
  return *(*found)->executor;  // the reader has checked the name
}

void Container::make_components() {
  for (const ComponentDescription& component : description_.components) {
    NodeOptions options;
    options.name = component.name;
    options.name_space = component.name_space;
    options.parameters = component.parameters;
    options.remap = component.remap;
    try {
      auto made = components().make(component.type, options);
      const std::shared_ptr<Node> node = made->node;
      components_.push_back(std::move(made));
      check_names(component, *node);
      place(component, node);
    } catch (const std::exception& error) {
      errors_.push_back(fmt::format("{}: component '{}' could not be made: {}", component.where,
                                    component.type, error.what()));
    }
  }
  if (!errors_.empty()) throw ConfigurationError(errors_);
}

// Names that only the constructor has made: now it is known which exist.
void Container::check_names(const ComponentDescription& component, const Node& node) {
  for (const std::string& name : node.unused_parameters()) {
    errors_.push_back(fmt::format("{}: component '{}' has no parameter '{}'",
                                  component.parameter_lines.at(name), component.type, name));
  }
  for (const std::string& name : node.unused_remaps()) {
    errors_.push_back(fmt::format("{}: component '{}' has no topic '{}' to remap",
                                  component.remap_lines.at(name), component.type, name));
  }
  std::vector<std::string> groups;
  for (const auto& group : node.groups()) groups.push_back(group->name());
  for (const auto& [name, group] : component.callback_groups) {
    if (std::find(groups.begin(), groups.end(), name) == groups.end()) {
      errors_.push_back(fmt::format("{}: component '{}' has no callback group '{}'; {}",
                                    group.where, component.type, name, suggest(name, groups)));
    }
  }
}

void Container::place(const ComponentDescription& component, const std::shared_ptr<Node>& node) {
  for (const auto& group : node->groups()) {
    const auto described = component.callback_groups.find(group->name());
    if (described == component.callback_groups.end()) continue;
    group->set_parameters(described->second.parameters);
    if (described->second.executor.empty()) continue;
    if (overrides_.executor.empty()) {
      executor_for(described->second.executor).add_callback_group(group, node);
    } else {
      notes_.push_back(
          fmt::format("{}: callback group '{}' of '{}' is under --executor {}, not under '{}'",
                      described->second.where, group->name(), node->name(), overrides_.executor,
                      described->second.executor));
    }
  }
  executor_for(component.executor).add_node(node);
}

void Container::start(std::function<void()> on_failure) {
  const auto note = [this](const std::string& refused) {
    if (!refused.empty()) notes_.push_back(refused);
  };
  if (description_.lock_memory) note(lock_memory(description_.realtime));
  if (description_.cpu_dma_latency_us) {
    // The request holds as long as the file is open.
    dma_latency_file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    const std::int32_t latency_us = *description_.cpu_dma_latency_us;
    if (dma_latency_file_ < 0 ||
        write(dma_latency_file_, &latency_us, sizeof latency_us) != sizeof latency_us) {
      const std::string refused = fmt::format("/dev/cpu_dma_latency: {}", errno_message(errno));
      if (description_.realtime == Realtime::require) {
        throw Error(refused, "run as root, or write `realtime: prefer` to go on without");
      }
      note(refused);
    }
  }
  // A log thread without its attributes is no reason to stop.
  Logger::instance().start([this] {
    if (has_thread("log")) apply(thread("log"), std::min(description_.realtime, Realtime::prefer));
  });
  if (has_thread("main")) note(apply(thread("main"), description_.realtime).refused);
  for (const auto& running : executors_) {
    running->executor->release_timers(false);
    running->thread = std::thread([&executor = *running, on_failure] {
      try {
        apply({.name = executor.name}, Realtime::off);  // what the file gives comes on top
        executor.executor->spin();
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
  // Timers were made one by one, some time ago; now that all threads are there, they start
  // together.
  for (const auto& component : components_) {
    for (const auto& entity : component->node->entities()) {
      if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->reset();
    }
  }
  for (const auto& running : executors_) running->executor->release_timers(true);
  started_ = Clock::steady().now();
  cpu_time_ = process_cpu_time();
}

// All is served when nothing was pending for several looks in a row: a message that goes from one
// executor to the next can escape one look, but not all.
bool Container::drain() {
  const TimePoint limit = Clock::steady().now() + kDrainLimit;
  for (int quiet = 0; quiet < 5; ++quiet) {
    for (const auto& running : executors_) {
      if (running->failed.load()) return true;
      if (running->executor->pending() != 0) quiet = -1;
    }
    if (Clock::steady().now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

void Container::stop() {
  for (const auto& running : executors_) running->executor->release_timers(false);
  stopped_ = Clock::steady().now();
  cpu_time_ = process_cpu_time() - cpu_time_;
  pss_kb_ = proportional_set_size_kb();
  if (!drain()) {
    notes_.push_back(fmt::format("messages were still under way {} s after the last timer",
                                 kDrainLimit.count()));
  }
  for (const auto& running : executors_) running->executor->cancel();
  for (const auto& running : executors_) {
    if (running->thread.joinable()) running->thread.join();
  }
  for (const auto& running : executors_) {
    if (running->exception != nullptr) std::rethrow_exception(running->exception);
  }
}

ProcessResult Container::result() const {
  ProcessResult result;
  result.name = description_.name;
  result.notes = notes_;
  const Nanoseconds wall = stopped_ - started_;
  result.duration_s = std::chrono::duration<double>(wall).count();
  result.cpu_percent = 100.0 * static_cast<double>(cpu_time_.count()) /
                       static_cast<double>(std::max<std::int64_t>(wall.count(), 1));
  result.pss_kb = pss_kb_;
  result.allocations_counted = allocations_are_counted();
  for (const auto& running : executors_) {
    for (auto& statistics : running->executor->statistics()) {
      result.callbacks.push_back({running->name, std::move(statistics)});
    }
    if (running->executor->statistics().empty()) continue;  // the default executor, unused
    for (auto& statistics : running->executor->thread_statistics()) {
      result.allocations_while_spinning += statistics.counters.allocations;
      if (!statistics.in_force.refused.empty()) result.notes.push_back(statistics.in_force.refused);
      result.threads.push_back({running->name, std::move(statistics)});
    }
  }
  return result;
}

}  // namespace takt
