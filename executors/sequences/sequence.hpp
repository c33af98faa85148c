// A program made of bytes: calls of the public API in any legal order, on two executors and a wait
// set, checked against a small model. libFuzzer, rapidcheck and fixed seeds bring the bytes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_SEQUENCE_HPP_
#define TAKT_EXECUTORS_SEQUENCES_SEQUENCE_HPP_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "takt/executors/sequences/api.hpp"

namespace takt::sequences {

/// Runs the program, which speaks this API; the result is the first promise that was broken, or
/// empty.
///
/// The first three bytes choose executor, scheduler and level of statistics; each further one is a
/// call, and those behind it its arguments. Callbacks make calls too, from the same bytes, among
/// them nested spins of the second executor; and so do destructors of what callbacks own, wherever
/// the library lets that go. Every duration may be none, the shortest, or for ever. The clock is
/// the program's own: it moves when it is read and when a call says so, so a program does the same
/// each time, except where another thread removes a node while callbacks publish to it, or sets a
/// promise when the spin that waits for it sleeps. A program that hangs or crashes ends the process
/// with its bytes.
///
/// What is checked:
/// - nothing runs after its removal, or after its handle was dropped; no cancelled timer runs, and
///   none whose period is for ever;
/// - two callbacks of an exclusive group never run at the same time;
/// - after spin_all no timer is due and no guard condition is triggered, and of each subscription
///   delivered + dropped = published;
/// - spin_once, spin_some and spin_until_future_complete end in time, however busy the callbacks
///   are, and a timer that is due runs though others keep the executor busy;
/// - an exception leaves the spin in which it was thrown;
/// - a call ends once, by its own answer or when its time is up, and a service that answers does;
///   a goal ends once, for its client and for its server, and both are notified;
/// - a coroutine that was dropped does not go on, one that has slept enough does;
/// - managed callbacks of a node that is not active rest; transitions end as their callbacks;
/// - a parameter that is refused keeps its value;
/// - a timer that is not held runs as often as time says, one that is held does not;
/// - a spin ends when the future comes that it waits for, whatever else waits for it;
/// - a promise, a handle or a message may come when the executor that waited for it has gone;
/// - every accepted thing ends, and its client or coroutine learns how: goals whose server has
/// gone, calls
///   without a service, coroutines that wait for either, or for a receiver that has gone;
/// - a goal that was accepted is given to its server; a result that is kept for ever is;
/// - a wait set lists what is ready, and an event reports what has changed, once;
/// - after all that, no entity, group or node is left;
/// - a scheduler is given only callbacks that it was configured for, each once at a time.
std::string run(std::span<const std::uint8_t> bytes, Api& api);
/// For libFuzzer: a promise that was broken ends the process.
void require(std::span<const std::uint8_t> bytes, Api& api);

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_SEQUENCE_HPP_
