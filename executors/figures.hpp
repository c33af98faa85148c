// What executors count and measure: the name of each figure, how two are merged, its meaning.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_FIGURES_HPP_
#define TAKT_EXECUTORS_FIGURES_HPP_

#include <tuple>

#include "takt/base/fields.hpp"
#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/chain.hpp"

namespace TAKT_INTERNAL takt {

template <>
inline constexpr auto kFields<CallbackCounts> = std::tuple{
    sum("received", &CallbackCounts::received, "Executions."),
    sum("expected", &CallbackCounts::expected,
        "Messages that were sent to it; of a timer the releases that were taken; 0 for "
        "waitables."),
    sum("from_outside", &CallbackCounts::from_outside,
        "Of these, messages that came from other processes.", Since::later),
    sum("dropped", &CallbackCounts::dropped,
        "Overwritten before they were taken, or of an aborted instance of a chain."),
    sum("dropped_by_mode", &CallbackCounts::dropped_by_mode,
        "Messages, or releases of a timer, that came in a mode that drops them.", Since::later),
    sum("late", &CallbackCounts::late,
        "Of period T, later than the smaller of 20 % of T and 5 ms. null: the publisher's period "
        "is not known here, as with messages from other processes."),
    sum("too_late", &CallbackCounts::too_late,
        "The same, later than the smaller of T and 50 ms; not among the late ones."),
    sum("deadline_misses", &CallbackCounts::deadline_misses,
        "Executions that ended after the deadline."),
    sum("overruns", &CallbackCounts::overruns,
        "Timer releases that were not served, and executions longer than the budget."),
    sum("skipped", &CallbackCounts::skipped,
        "Of these, the releases: they came while one was outstanding, or the timer was never "
        "served.",
        Since::later),
    sum("allocations", &CallbackCounts::allocations,
        "In its executions, with the message taken and what they publish, without those inside "
        "Cyclone DDS. null: the program does not count them (`takt run --allocations`), or has no "
        "statistics `full`.",
        Since::later),
};

template <>
inline constexpr auto kFields<CountedCallback> = std::tuple{
    keep("node", &CountedCallback::node, "The full name."),
    keep("group", &CountedCallback::group, "Its callback group."),
    keep("callback", &CountedCallback::callback,
         "The timer's name, or the topic as the node wrote it."),
    keep("kind", &CountedCallback::kind, "What it is a callback of."),
    keep("topic", &CountedCallback::topic, "As resolved; empty for all but subscriptions."),
    BasePart<CallbackCounts>{},
    computed("lost", &CountedCallback::lost,
             "expected - received - dropped - dropped_by_mode, for subscriptions; else 0."),
};

template <>
inline constexpr auto kFields<CallbackTimes> = std::tuple{
    sum("latency_us", &CallbackTimes::latency,
        "Published, before it was encoded, or due to the start of the callback. Of a message: "
        "waiting and take."),
    sum("execution_us", &CallbackTimes::execution, "The callback alone."),
};

template <>
inline constexpr auto kFields<MessageTimes> = std::tuple{
    sum("waiting_us", &MessageTimes::waiting,
        "Without samples for timers and waitables, which take no message. Published until a "
        "thread of the executor picks the callback.",
        Since::later),
    sum("take_us", &MessageTimes::take,
        "Without samples for timers and waitables. Picked until the callback starts: taking the "
        "message, and decoding it if it came from another process.",
        Since::later),
};

template <>
inline constexpr auto kFields<CallbackStatistics> =
    std::tuple{BasePart<CountedCallback>{}, BasePart<CallbackTimes>{}, BasePart<MessageTimes>{}};

template <>
inline constexpr auto kFields<ChainStatistics> = std::tuple{
    sum("instances", &ChainStatistics::instances, "That have come to the end."),
    sum("misses", &ChainStatistics::misses, "Of these, after the deadline."),
    sum("aborted", &ChainStatistics::aborted, "Ended before the end by overrun: abort."),
    sum("latency_us", &ChainStatistics::latency,
        "Release of the first callback to the end of the last."),
};

template <>
inline constexpr auto kFields<ThreadStatistics> = std::tuple{
    keep("asked", &ThreadStatistics::asked, "What was asked for."),
    keep("in_force", &ThreadStatistics::in_force, "What the kernel gave."),
    sum("counters", &ThreadStatistics::counters, "What the kernel counts."),
    sum("cpu_time", &ThreadStatistics::cpu_time, "From spin to its end."),
    sum("wall_time", &ThreadStatistics::wall_time, "The same."),
    sum("spin_time", &ThreadStatistics::spin_time, "Of the CPU time: for `spin` and `early_wake`."),
    sum("missed_periods", &ThreadStatistics::missed_periods,
        "With logical execution time: periods that began late or not at all."),
    sum("dropped_outputs", &ThreadStatistics::dropped_outputs,
        "With logical execution time: messages that did not fit into a period."),
    sum("trace", &ThreadStatistics::trace, "Its last executions."),
    sum("trace_overwritten", &ThreadStatistics::trace_overwritten, "Executions before these."),
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_FIGURES_HPP_
