// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/running_trace.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/printable.hpp"

namespace takt {
namespace {

// Limit: executions that a container keeps for a timeline, of all its threads; they take 92 MB. At
// it: each thread has room for fewer, at least 1024. Seen: `overwritten` of the trace.
constexpr std::size_t kMostTracedInAll = std::size_t{1} << 20;

// Limit: threads of the machine that a trace of a container names. At it: others have numbers only.
// Seen: in the trace.
constexpr std::size_t kMostNames = 5000;

std::int64_t ns_of(TimePoint time) {
  return time.time_since_epoch().count();
}

// The elements of one page.
template <class T>
std::vector<T> page_of(const std::vector<T>& all, std::size_t page) {
  const auto at = [&](std::size_t place) {
    return all.begin() +
           static_cast<std::ptrdiff_t>(std::min(place * TraceContainer::kMostOfPage, all.size()));
  };
  return {at(page), at(page + 1)};
}

TraceContainer::Event event_of(const NamedTraceEvent& event, std::size_t thread,
                               std::uint32_t callback) {
  return {.thread = static_cast<std::uint32_t>(thread),
          .callback = callback,
          .sequence = event.sequence,
          .chain_instance = event.chain_instance,
          .path = event.path,
          .cause = event.cause,
          .lost = event.lost,
          .ready_ns = ns_of(event.ready),
          .picked_ns = ns_of(event.picked),
          .start_ns = ns_of(event.start),
          .end_ns = ns_of(event.end),
          .cpu_time_ns = event.cpu_time.count(),
          .has_waited = event.has_waited};
}

TraceContainer::Thread thread_of(const RunningExecutor& running, const ThreadStatistics& traced) {
  const ExecutorDescription& made = running.description;
  const TriggerOptions& trigger = made.trigger;
  return {.executor = running.name,
          .executor_type = made.type,
          .scheduler = scheduler_of(made),
          .name = traced.in_force.name,
          .tid = traced.in_force.tid,
          .is_realtime = is_realtime(traced.in_force.policy),
          .is_held = trigger.kind != TriggerOptions::Kind::any ||
                     trigger.let_period != Nanoseconds::zero(),
          .overwritten = traced.trace_overwritten};
}

std::size_t pages_of(std::size_t count) {
  return (count + TraceContainer::kMostOfPage - 1) / TraceContainer::kMostOfPage;
}

}  // namespace

RunningTrace::~RunningTrace() {
  if (begun_ == nullptr && !kept_) return;
  log(LogLevel::warn,
      "the container was traced, and ends before `takt trace stop` has written that");
}

TraceContainer::Response RunningTrace::serve(const TraceContainer::Request& request) {
  TraceContainer::Response answer;
  const std::lock_guard lock(mutex_);
  try {
    if (request.command == "start") {
      start(request.clock);
    } else if (request.command == "stop") {
      stop(answer);
    } else if (request.command == "read") {
      read(request.page, answer);
    } else if (request.command == "forget") {
      kept_.reset();
    } else {
      throw Error(fmt::format("'{}' is nothing that a trace can do", printable(request.command)),
                  "valid: start, stop, read, forget");
    }
    answer.success = true;
  } catch (const std::exception& error) {
    answer = {};
    answer.reason = error.what();
  }
  return answer;
}

std::size_t RunningTrace::room() const {
  std::size_t threads = 0;
  for (const auto& running : executors_) {
    if (!running->is_own) threads += running->executor->running_threads().size();
  }
  const std::size_t each = kMostTracedInAll / std::max<std::size_t>(threads, 16);
  return std::max<std::size_t>(std::bit_floor(each), 1024);
}

void RunningTrace::start(const std::string& clock) {
  if (begun_ != nullptr) {
    const auto since =
        std::chrono::duration_cast<std::chrono::seconds>(Clock::steady().now() - begun_->at);
    throw Error(fmt::format("it is traced already, since {} s", since.count()),
                "end that with `takt trace stop`, which writes the file");
  }
  if (kept_) {
    throw Error("its last trace was not written yet", "write it with `takt trace stop`");
  }
  const TraceClock by(clock);
  const auto end_all = [this](void*) noexcept {
    for (const auto& running : executors_) running->executor->end_trace();
  };
  std::unique_ptr<void, decltype(end_all)> end_unless_all_began(this, end_all);
  const std::size_t events = std::min(room(), kMostTraceEvents);
  for (const auto& running : executors_) {
    if (!running->is_own) running->executor->begin_trace(events);
  }
  begun_ =
      std::make_unique<Begun>(Begun{clock, by, by.offset(), Clock::steady().now(), Scheduling()});
  end_unless_all_began.release();
}

void RunningTrace::stop(TraceContainer::Response& answer) {
  if (begun_ == nullptr && kept_) {
    answer = kept_->stopped;  // the previous client could not write the trace
    return;
  }
  if (begun_ == nullptr) {
    throw Error("it is not traced", "begin with `takt trace start`");
  }
  std::vector<TraceContainer::Event> events;
  std::vector<TraceContainer::Switch> switches;
  for (const auto& running : executors_) {
    if (!running->is_own) running->executor->end_trace();
  }
  const std::unique_ptr<Begun> begun = std::exchange(begun_, nullptr);
  answer.clock = begun->name;
  answer.begin_ns = ns_of(begun->at);
  answer.end_ns = ns_of(Clock::steady().now());
  answer.begin_offset_ns = begun->offset.count();
  answer.end_offset_ns = begun->clock.offset().count();
  std::map<std::pair<std::string, EntityKind>, std::uint32_t> numbers;  // of callbacks
  for (const auto& running : executors_) {
    if (running->is_own || !running->has_begun.load()) continue;
    for (const ThreadStatistics& traced : running->executor->traces()) {
      for (const NamedTraceEvent& event : traced.trace) {
        const auto [known, is_new] = numbers.try_emplace(
            {event.name, event.kind}, static_cast<std::uint32_t>(numbers.size()));
        if (is_new) answer.callbacks.push_back({event.name, std::string(to_string(event.kind))});
        events.push_back(event_of(event, answer.threads.size(), known->second));
      }
      answer.threads.push_back(thread_of(*running, traced));
    }
  }
  const Scheduling::Seen seen = begun->scheduling.end();
  for (const Scheduling::Event& event : seen.events) {
    switches.push_back({ns_of(event.time), event.cpu, event.thread, event.next_thread,
                        event.was_preempted, event.is_wakeup});
  }
  for (const auto& [thread, name] : seen.names) {
    if (answer.names.size() < kMostNames) answer.names.push_back({thread, name});
  }
  answer.missing = seen.missing;
  answer.pages =
      static_cast<std::uint32_t>(std::max(pages_of(events.size()), pages_of(switches.size())));
  kept_.emplace(answer, std::move(events), std::move(switches));
}

void RunningTrace::read(std::size_t page, TraceContainer::Response& answer) {
  if (!kept_) throw Error("there is no trace to read: another one may have written it");
  const std::size_t pages = kept_->stopped.pages;
  if (page >= pages) throw Error(fmt::format("there is no page {} of {}", page, pages));
  answer.events = page_of(kept_->events, page);
  answer.switches = page_of(kept_->switches, page);
}

}  // namespace takt
