// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/running_executors.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/base/manual_clock.hpp"

namespace takt {

std::string scheduler_of(const ExecutorDescription& made) {
  return made.scheduler.empty() ? executors().traits(made.type).scheduler : made.scheduler;
}

std::string RunningExecutor::note() const {
  if (differs.empty()) return {};
  return fmt::format("executor '{}' is '{}' here, {}", name, description.type, differs);
}

RunningExecutor& RunningExecutors::add(std::string name, std::unique_ptr<Executor> executor) {
  all_.push_back(std::make_unique<RunningExecutor>());
  all_.back()->name = std::move(name);
  all_.back()->executor = std::move(executor);
  return *all_.back();
}

RunningExecutor& RunningExecutors::named(const std::string& name) const {
  return **std::find_if(all_.begin(), all_.end(),
                        [&](const auto& running) { return running->name == name; });
}

std::vector<std::string> RunningExecutors::names() const {
  std::vector<std::string> names;
  for (const auto& running : all_)
    if (!running->is_own) names.push_back(running->name);
  return names;
}

std::size_t RunningExecutors::pending() const noexcept {
  std::size_t count = 0;
  for (const auto& running : all_)
    if (!running->is_own && !running->has_ended.load()) count += running->executor->pending();
  return count;
}

std::vector<int> RunningExecutors::threads_of_callbacks() const {
  std::vector<int> result;
  for (const auto& running : all_) {
    if (running->is_own) continue;
    const std::vector<int> its = running->executor->running_threads();
    result.insert(result.end(), its.begin(), its.end());
  }
  return result;
}

void RunningExecutors::start(Realtime realtime, Clock& clock, ExceptionHandler handler,
                             std::function<void()> on_failure) {
  const std::lock_guard lock(mutex_);
  ManualClock* const manual = clock.as_manual();
  simulation_ = manual != nullptr && manual->has_cpus() ? manual : nullptr;
  if (simulation_ != nullptr) participants_ = simulation_->use().size();  // of other processes
  may_begin_ = true;
  realtime_ = realtime;
  handler_ = std::move(handler);
  on_failure_ = std::move(on_failure);
}

bool RunningExecutors::spin(RunningExecutor& running) {
  if (running.has_begun.load()) return false;
  const std::lock_guard lock(mutex_);
  if (!may_begin_ || running.has_begun.load()) return false;
  running.thread = std::thread([this, &running] {
    try {
      // Start from default attributes, not from those of this thread.
      apply({.name = running.name}, std::min(realtime_, Realtime::prefer));
      running.executor->spin(handler_);
    } catch (...) {
      running.exception = std::current_exception();
    }
    running.has_ended.store(true);
    if (running.exception != nullptr && on_failure_) on_failure_();
  });
  running.has_begun.store(true);  // not set if std::thread throws: the next call may succeed
  while (!running.executor->is_spinning() && !running.has_ended.load()) {
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  if (simulation_ != nullptr && !running.has_ended.load()) {
    participants_ += running.executor->thread_count();
    simulation_->wait_for_participants(participants_);
  }
  return true;
}

void RunningExecutors::cancel() noexcept {
  {
    const std::lock_guard lock(mutex_);
    may_begin_ = false;
  }
  for (const auto& running : all_) running->executor->cancel();
}

std::exception_ptr RunningExecutors::join() {
  std::exception_ptr failure;
  for (const auto& running : all_) {
    std::unique_lock lock(mutex_);
    const bool has_thread = running->thread.joinable();
    lock.unlock();
    if (has_thread) running->thread.join();
    if (failure == nullptr) failure = running->exception;
  }
  return failure;
}

}  // namespace takt
