// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/measured_usage.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>

#include "takt/containers/process_usage.hpp"

namespace takt {
namespace {

// Adds (or subtracts) the kernel's counters of a thread. Returns false if the thread has ended.
bool read_counters(int tid, ThreadStatistics& thread, int sign) {
  const auto usage = thread_usage(tid);
  if (!usage) return false;
  thread.cpu_time += sign * usage->cpu_time;
  thread.counters.voluntary_switches +=
      static_cast<std::uint64_t>(sign) * usage->voluntary_switches;
  return true;
}

}  // namespace

MeasuredUsage::MeasuredUsage(const ContainerSetting& setting) : setting_(setting) {
  if (setting.participant == nullptr) return;
  for (const ThreadState& thread : setting.participant->threads())
    dds_threads_.push_back({.asked = setting.description.dds->threads, .in_force = thread});
}

void MeasuredUsage::begin() {
  begin_ = setting_.overrides.clock->now();
  if (setting_.is_simulated()) return;
  std::error_code ended;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ended)) {
    const int tid = std::atoi(task.path().filename().c_str());
    read_counters(tid, counted_[tid], -1);
  }
  cpu_time_ = process_cpu_time();
}

void MeasuredUsage::end() {
  end_ = setting_.overrides.clock->now();
  if (setting_.is_simulated()) return;
  cpu_time_ = process_cpu_time() - cpu_time_;
  for (auto task = counted_.begin(); task != counted_.end();) {
    task = read_counters(task->first, task->second, 1) ? std::next(task) : counted_.erase(task);
  }
  pss_kb_ = proportional_set_size_kb();
  for (ThreadStatistics& thread : dds_threads_) {
    thread.in_force = thread_state(thread.in_force.tid);  // by now Cyclone has named it
  }
}

void MeasuredUsage::complete(ThreadStatistics& thread) const {
  const auto counted = counted_.find(thread.in_force.tid);
  if (counted == counted_.end()) return;
  thread.cpu_time = counted->second.cpu_time;
  thread.wall_time = end_ - begin_;
  thread.spin_time = std::min(thread.spin_time, thread.cpu_time);
  thread.counters.voluntary_switches = counted->second.counters.voluntary_switches;
}

void MeasuredUsage::add_to(ProcessResult& result) const {
  const Nanoseconds wall = end_ - begin_;
  result.duration_s = std::chrono::duration<double>(wall).count();
  result.cpu_percent = 100.0 * static_cast<double>(cpu_time_.count()) /
                       static_cast<double>(std::max<std::int64_t>(wall.count(), 1));
  result.pss_kb = pss_kb_;
  for (ThreadStatistics thread : dds_threads_) {
    complete(thread);
    result.threads.push_back({"dds", std::move(thread)});
  }
}

}  // namespace takt
