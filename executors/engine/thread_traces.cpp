// What the threads of an executor have counted and traced.
// SPDX-License-Identifier: Apache-2.0
#include <mutex>
#include <utility>

#include "takt/base/error.hpp"
#include "takt/executors/engine/callbacks.hpp"
#include "takt/executors/engine/observation.hpp"

namespace takt::detail {

// ---- Control threads ----

std::vector<ThreadStatistics> Callbacks::thread_statistics() const {
  const std::lock_guard lock(mutex_);
  if (is_spinning_) {
    throw Error("executor '" + options_.name + "' is spinning",
                "read the statistics of its threads afterwards");
  }
  return dispatcher_.observation().thread_statistics(records_, dispatcher_.workers());
}

void Callbacks::begin_trace(std::size_t events) {
  const std::lock_guard lock(mutex_);
  dispatcher_.observation().begin_trace(records_, dispatcher_.workers(), events);
}

void Callbacks::end_trace() noexcept {
  const std::lock_guard lock(mutex_);
  if (options_.trace_events != 0) return;
  for (Worker& worker : dispatcher_.workers().all()) worker.trace.end();
}

std::vector<ThreadStatistics> Callbacks::traces(
    const std::vector<std::atomic<int>>& threads) const {
  const std::lock_guard lock(mutex_);
  std::vector<ThreadStatistics> traces =
      dispatcher_.observation().traces(records_, dispatcher_.workers());
  for (std::size_t i = 0; i < traces.size(); ++i) {
    traces[i].asked = dispatcher_.workers().all()[i].attributes;
    if (const int thread = threads[i].load(); thread != 0) {
      traces[i].in_force = thread_state(thread);
    } else if (!is_spinning_ && i < dispatcher_.observation().threads().size()) {
      traces[i].in_force = dispatcher_.observation().threads()[i].in_force;
    }
  }
  return traces;
}

// ---- With the mutex of the callbacks ----

std::vector<ThreadStatistics> Observation::thread_statistics(const CallbackRecords& records,
                                                             const Workers& workers) const {
  std::vector<ThreadStatistics> threads = threads_;
  if (options_.trace_events == 0) return threads;
  std::vector<ThreadStatistics> traced = traces(records, workers);
  threads.resize(traced.size());
  for (std::size_t i = 0; i < traced.size(); ++i) {
    threads[i].trace = std::move(traced[i].trace);
    threads[i].trace_overwritten = traced[i].trace_overwritten;
  }
  return threads;
}

void Observation::begin_trace(const CallbackRecords& records, Workers& workers,
                              std::size_t events) {
  check_begin_trace(options_);
  is_traced_ = true;
  for (const auto& [id, record] : records) record->begin_trace();
  for (Worker& worker : workers.all()) worker.trace.begin(events);
}

std::vector<ThreadStatistics> Observation::traces(const CallbackRecords& records,
                                                  const Workers& workers) const {
  const auto with_name = [&](const TraceEvent& event) {
    if (const auto present = records.find(event.callback); present != records.end()) {
      const Traced traced(*present->second);
      return named(event, &traced);
    }
    const auto gone = traced_.find(event.callback);
    return named(event, gone != traced_.end() ? &gone->second : nullptr);
  };
  std::vector<ThreadStatistics> threads(workers.all().size());
  for (const Worker& worker : workers.all()) {
    ThreadStatistics& thread = threads[worker.index];
    for (const TraceEvent& event : worker.trace.events()) thread.trace.push_back(with_name(event));
    thread.trace_overwritten = worker.trace.overwritten();
  }
  return threads;
}

}  // namespace takt::detail
