// What the fields of a run in results mean: for its JSON, CSV, schema and page.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_RUN_FIELDS_HPP_
#define TAKT_MEASURING_RUN_FIELDS_HPP_

#include <tuple>

#include "takt/executors/figures.hpp"
#include "takt/measuring/run.hpp"

namespace takt {

template <>
inline constexpr auto kFields<rt::Run::Callback> = std::tuple{
    keep("process", &rt::Run::Callback::process, "Its name."),
    keep("executor", &rt::Run::Callback::executor,
         "Its name; of one that a program makes, its type."),
    Part{&rt::Run::Callback::statistics},
};

template <>
inline constexpr auto kFields<rt::Run::Chain> = std::tuple{
    keep("process", &rt::Run::Chain::process, "Its name."),
    keep("name", &rt::Run::Chain::name, "Of the chain."),
    keep("deadline_us", &rt::Run::Chain::deadline,
         "0: none, or the chain goes through several processes."),
    Part{&rt::Run::Chain::statistics},
};

template <>
inline constexpr auto kFields<rt::Run::Executor> = std::tuple{
    keep("process", &rt::Run::Executor::process, "Its name."),
    keep("name", &rt::Run::Executor::name, "Of the executor."),
    keep("type", &rt::Run::Executor::type, "See takt list executors."),
    keep("scheduler", &rt::Run::Executor::scheduler, "In force."),
    keep("threads_given", &rt::Run::Executor::threads_given,
         "By the file; 0: the type decides. Those that ran are in 'threads'."),
};

template <>
inline constexpr auto kFields<rt::Run::Thread> = std::tuple{
    keep("process", &rt::Run::Thread::process, "Its name."),
    keep("executor", &rt::Run::Thread::executor,
         "Its name; of one that a program makes, its type."),
    keep("name", &rt::Run::Thread::name, "As Linux has it: at most 15 characters."),
    keep("asked", &rt::Run::Thread::asked, "The attributes that the file gives it."),
    keep("in_force", &rt::Run::Thread::in_force, "The attributes that Linux has given it."),
    sum("cpu_percent", &rt::Run::Thread::cpu_percent,
        "Of one CPU, from the beginning to the end of spin."),
    sum("spin_percent", &rt::Run::Thread::spin_percent,
        "Of cpu_percent: the thread spun, for `spin` or `early_wake`.", Since::later),
    sum("wakeups", &rt::Run::Thread::wakeups, "Voluntary context switches."),
};

template <>
inline constexpr auto kFields<rt::Run::Process> = std::tuple{
    keep("name", &rt::Run::Process::name,
         "Of the process; takt and iox-roudi are processes of the run, too."),
    sum("pss_kb", &rt::Run::Process::pss_kb,
        "Proportional set size when the timers ended; 0 where the kernel does not tell."),
    sum("cpu_percent", &rt::Run::Process::cpu_percent, "Of one CPU."),
    sum("allocations_while_spinning", &rt::Run::Process::allocations_while_spinning,
        "On executor threads; null when the program does not count them."),
    sum("allocations_in_dds", &rt::Run::Process::allocations_in_dds,
        "Of the same threads, inside Cyclone DDS.", Since::later),
};

template <>
inline constexpr auto kFields<rt::Run::Topic> = std::tuple{
    keep("process", &rt::Run::Topic::process, "Its name."),
    keep("topic", &rt::Run::Topic::topic, "As resolved."),
    keep("type", &rt::Run::Topic::type, "Of its messages."),
    keep("is_writer", &rt::Run::Topic::is_writer, "Whether it is a publisher."),
    keep("is_reliable", &rt::Run::Topic::is_reliable, "As its reliability says."),
    sum("matched", &rt::Run::Topic::matched, "Ends in other processes."),
    sum("messages", &rt::Run::Topic::messages,
        "Sent to, or received from, other processes; with those overwritten in shared memory."),
    keep("transport", &rt::Run::Topic::transport,
         "'shared memory' (used if the other end can use it, too), or 'UDP: ' and the reason."),
    sum("uncopied", &rt::Run::Topic::uncopied,
        "Of these: lent by shared memory, or read where they lay."),
    sum("lost", &rt::Run::Topic::lost,
        "Not sent, as there was no room; or overwritten in shared memory before they were "
        "received."),
};

template <>
inline constexpr auto kFields<ProcessResult::Deviation> = std::tuple{
    keep("process", &ProcessResult::Deviation::process, "Its name."),
    keep("id", &ProcessResult::Deviation::id,
         "Of the assumption; bound: what was computed itself."),
    keep("text", &ProcessResult::Deviation::text, "What was seen, the worst of it."),
    sum("count", &ProcessResult::Deviation::count, "How often; of the host's time, ticks."),
    keep("chains", &ProcessResult::Deviation::chains, "Whose bounds rest on it."),
};

template <>
inline constexpr auto kFields<ProcessResult::ModeSwitch> = std::tuple{
    keep("process", &ProcessResult::ModeSwitch::process, "Its name."),
    keep("mode", &ProcessResult::ModeSwitch::mode, "That came into force."),
    keep("cause", &ProcessResult::ModeSwitch::cause, "Why it did."),
    keep("after_us", &ProcessResult::ModeSwitch::after, "Since the start of the timers."),
    keep("begin_ns", &ProcessResult::ModeSwitch::begin_ns,
         "When executors got the changes, by the clock of the trace's events."),
    keep("end_ns", &ProcessResult::ModeSwitch::end_ns,
         "What a thread picks later is served as the mode says."),
};

template <>
inline constexpr auto kFields<rt::Run::Releases> = std::tuple{
    sum("due", &rt::Run::Releases::due, "Releases that were due."),
    sum("served", &rt::Run::Releases::served, "Those that a callback has run for."),
};

template <>
inline constexpr auto kFields<rt::Run::Traced> = std::tuple{
    keep("process", &rt::Run::Traced::process, "Its name."),
    keep("executor", &rt::Run::Traced::executor, "Its name."),
    keep("executor_type", &rt::Run::Traced::executor_type, "Its type."),
    keep("scheduler", &rt::Run::Traced::scheduler, "In force."),
    keep("thread", &rt::Run::Traced::thread, "Its name."),
    keep("tid", &rt::Run::Traced::tid, "Of Linux."),
    keep("is_realtime", &rt::Run::Traced::is_realtime, "By its policy."),
    sum("overwritten", &rt::Run::Traced::overwritten, "Executions before these."),
    keep("events", &rt::Run::Traced::events, "Its last executions."),
};

template <>
inline constexpr auto kFields<rt::Run> = std::tuple{
    keep("file", &rt::Run::file,
         "The path as it was given; of a program after --, with its words; by TAKT_RESULTS, its "
         "path."),
    keep("executor", &rt::Run::executor,
         "What --executor or TAKT_EXECUTOR said; 'file' without it."),
    keep("placement", &rt::Run::placement,
         "file, or merged: one executor of the type 'executor' serves all components of a "
         "process. Results without it, of an earlier Takt, are so unless 'executor' is 'file'.",
         Since::later),
    keep("scheduler", &rt::Run::scheduler,
         "What --scheduler or TAKT_SCHEDULER said; 'file' without it."),
    keep("composition", &rt::Run::composition, "file, single, per-node or dynamic."),
    keep("transport", &rt::Run::transport, "auto, intra, dds or shm."),
    keep("duration_s", &rt::Run::duration_s, "From the start of the timers to their end."),
    keep("repeat", &rt::Run::repeat, "From 0; always 0 for takt run."),
    sum("callbacks", &rt::Run::callbacks, "Of components."),
    computed("releases", &rt::Run::releases,
             "Of all timers together. What was not served was skipped, or dropped by a mode."),
    sum("chains", &rt::Run::chains, "One for each piece of a chain that lies in one process."),
    sum("executors", &rt::Run::executors,
        "Those of components that ran; without the container's own.", Since::later),
    sum("threads", &rt::Run::threads, "Of executors and of Cyclone DDS."),
    sum("processes", &rt::Run::processes, "All of the run."),
    sum("topics", &rt::Run::topics, "One for each end of a topic in a process on DDS.",
        Since::later),
    sum("deviations", &rt::Run::deviations,
        "Only with --watch-bounds: what the analysis assumes, and was otherwise.", Since::later),
    sum("mode_switches", &rt::Run::mode_switches,
        "Of the file's `modes:`, the last thousand of each process.", Since::later),
    sum("active_nodes", &rt::Run::active_nodes, "Nodes with a lifecycle that have been active.",
        Since::later),
    sum("notes", &rt::Run::notes, "What was refused, ignored or left undone.", Since::later),
    sum("trace", &rt::Run::trace,
        "Only by TAKT_TRACE: for takt run --trace, which makes a timeline of it.", Since::later),
    keep("over_time", &rt::Run::over_time, "Null: there were no messages.", Since::later),
};

}  // namespace takt

#endif  // TAKT_MEASURING_RUN_FIELDS_HPP_
