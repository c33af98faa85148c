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

/// Runs the program on this API. Returns the first promise that was broken, or an empty string.
///
/// The first three bytes choose executor, scheduler and level of statistics; each further one is a
/// call, and the bytes behind it are its arguments. Callbacks make calls too, from the same bytes,
/// among them nested spins of the second executor; so do destructors of objects that callbacks own,
/// wherever the library destroys them. Every duration may be zero, the shortest, or for ever. The
/// clock is the program's own: it moves when it is read and when a call says so, so a program does
/// the same each time, except where another thread removes a node while callbacks publish to it, or
/// sets a promise while the spin that waits for it sleeps. A program that hangs or crashes ends the
/// process with its bytes.
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
/// - a call ends once, with its own answer or when its time is up; if a service answers at once,
///   with its answer; a goal ends once, for its client and for its server, and both are notified;
/// - a coroutine that was dropped does not continue, one whose sleep is over does;
/// - managed callbacks of an inactive node do not run; transitions end as their callbacks say;
/// - a parameter that is refused keeps its value;
/// - a timer runs once for each release that its period gives, and not while timers are held;
/// - a spin ends when its future becomes ready, whatever else waits for that future;
/// - a promise, a handle or a message may outlive the executor that waited for it;
/// - every accepted goal, call and coroutine ends, and its client or coroutine learns how: goals
///   whose server has gone, calls without a service, coroutines that wait for either, or for a
///   receiver that has gone;
/// - an accepted goal reaches its server, and a result that is kept for ever is still there;
/// - a wait set lists what is ready, and an event reports what has changed, once;
/// - at the end, no entity, group or node is left;
/// - a scheduler is given only callbacks that it was configured for, each once at a time.
std::string run(std::span<const std::uint8_t> bytes, Api& api);
/// For libFuzzer: a promise that was broken ends the process.
void require(std::span<const std::uint8_t> bytes, Api& api);

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_SEQUENCE_HPP_
