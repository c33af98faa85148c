// TraceContainer: the service that records what a running container does, for a timeline.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_TRACE_CONTAINER_HPP_
#define TAKT_CONTAINERS_TRACE_CONTAINER_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {

/// The service `/CONTAINER/trace`. Each container that has GetStatistics has it, too.
/// 1. `start`: each thread of an executor records its last executions from now on, and the
///    container records context switches, where Linux permits that.
/// 2. `stop`: recording ends, and the answer has the number of pages. Until `forget`, another
///    `stop` gets the same answer.
/// 3. `read`: returns a page.
/// 4. `forget`: the client has written the trace; before that, `start` is refused.
struct TraceContainer {
  // Limit: executions of an answer, and as many switches. At it: the next page has the others.
  // Seen: the number of pages.
  static constexpr std::size_t kMostOfPage = 1000;

  /// Times are of CLOCK_MONOTONIC.
  struct Event {
    std::uint32_t thread = 0, callback = 0;  // in `threads`, in `callbacks`
    std::uint64_t sequence = 0, chain_instance = 0, path = 0, cause = 0, lost = 0;
    std::int64_t ready_ns = 0, picked_ns = 0, start_ns = 0, end_ns = 0, cpu_time_ns = 0;
    bool has_waited = false;
  };
  /// A context switch or a wake-up in the kernel: see Scheduling.
  struct Switch {
    std::int64_t time_ns = 0;
    std::int32_t cpu = 0;
    std::uint32_t thread = 0, next_thread = 0;
    bool was_preempted = false, is_wakeup = false;
  };
  struct Callback {
    std::string name, kind;
  };
  struct Thread {
    std::string executor, executor_type, scheduler, name;
    std::int32_t tid = 0;
    bool is_realtime = false, is_held = false;  // a trigger or a period decides when it runs
    std::uint64_t overwritten = 0;
  };
  /// A thread that was switched.
  struct Name {
    std::uint32_t thread = 0;
    std::string name;
  };
  /// A mode that came into force, see ProcessResult::ModeSwitch.
  struct Mode {
    std::string mode, cause;
    std::int64_t begin_ns = 0, end_ns = 0;
  };
  struct Request {
    std::string command;     // "start", "stop", "read", "forget"
    std::string clock;       // of `start`: see TraceClock
    std::uint32_t page = 0;  // of `read`: from 0
  };
  struct Response {
    bool success = false;
    std::string reason;  // empty, or why not
    // Of `stop`:
    std::string clock;
    std::int64_t begin_ns = 0, end_ns = 0;                // of CLOCK_MONOTONIC
    std::int64_t begin_offset_ns = 0, end_offset_ns = 0;  // of `clock` from CLOCK_MONOTONIC
    std::uint32_t pages = 0;
    std::vector<Thread> threads;
    std::vector<Callback> callbacks;
    std::vector<Name> names;
    std::string missing;  // what is missing of the switches, and why
    std::vector<Mode> modes;
    // Of `read`:
    std::vector<Event> events;
    std::vector<Switch> switches;
  };
};
TAKT_MESSAGE(TraceContainer::Event, "takt_interfaces/msg/TraceEvent", thread, callback, sequence,
             chain_instance, path, cause, lost, ready_ns, picked_ns, start_ns, end_ns, cpu_time_ns,
             has_waited);
TAKT_MESSAGE(TraceContainer::Switch, "takt_interfaces/msg/TraceSwitch", time_ns, cpu, thread,
             next_thread, was_preempted, is_wakeup);
TAKT_MESSAGE(TraceContainer::Callback, "takt_interfaces/msg/TraceCallback", name, kind);
TAKT_MESSAGE(TraceContainer::Thread, "takt_interfaces/msg/TraceThread", executor, executor_type,
             scheduler, name, tid, is_realtime, is_held, overwritten);
TAKT_MESSAGE(TraceContainer::Name, "takt_interfaces/msg/TraceName", thread, name);
TAKT_MESSAGE(TraceContainer::Mode, "takt_interfaces/msg/TraceMode", mode, cause, begin_ns, end_ns);
TAKT_MESSAGE(TraceContainer::Request, "takt_interfaces/srv/TraceContainer_Request", command, clock,
             page);
TAKT_MESSAGE(TraceContainer::Response, "takt_interfaces/srv/TraceContainer_Response", success,
             reason, clock, begin_ns, end_ns, begin_offset_ns, end_offset_ns, pages, threads,
             callbacks, names, missing, modes, events, switches);

}  // namespace takt

#endif  // TAKT_CONTAINERS_TRACE_CONTAINER_HPP_
