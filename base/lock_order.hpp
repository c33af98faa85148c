// In which order a thread takes the locks of Takt.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCK_ORDER_HPP_
#define TAKT_BASE_LOCK_ORDER_HPP_

#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A kind of lock, outermost first: a thread that holds one takes only such as come after it, so no
/// two threads wait for each other. Debug and sanitizer builds end the program otherwise
/// (TAKT_CHECK_LOCKS). Each says what is taken while it is held; no thread holds two of one kind.
/// A lock under which none is taken, and nothing of a user runs, is a `leaf`, and need not be here.
///
/// A plain std::mutex is not in the order: only set-up, other processes' discovery and simulated
/// time have some. They come before all of these where they call the library (the lists of a
/// container and of rclcpp's layer), and after all of them where the library calls them
/// (registries, threads that come and go, the manual clock).
enum class LockRank : std::uint8_t {
  bound_watch,     // of a container: asks executors, nodes and chains
  isolated,        // children of `isolated`: asks and makes executors
  callback_lists,  // of an executor: asks nodes, gives entities an owner, installs (dispatch)
  observer,        // the same, of an executor without the engine
  wait_set,        // gives entities an owner, attaches them
  parameters,      // a change of a node's: its values, publishes it, may switch the node's clock
  time_source,     // sets the clocks that follow it
  action_server,   // goals: publishes their status, sets the timer that ends results
  all_outputs,     // of logical execution time: goes through them
  outputs,         // one executor's: sends them
  topics,          // readers and writers that find each other: hands the history over, tells events
  dispatch,        // of an executor: attaches entities, takes, asks chains
  managed,         // a subscription of a lifecycle node: attaches it, announces what waits
  history,         // of a publisher that keeps messages: sends one
  responses,       // that wait for their clients: looks who hears, sends
  status_event,    // of a reader or writer: asks its end
  awaited_message,  // coroutines that wait for a message: lets one go on
  client_alarm,     // when a call ends without an answer: looks at the calls
  kept_requests,    // that a client repeats: looks at the calls
  calls,            // of a client, in flight: lets a coroutine go on
  tasks,  // of a node, coroutines: sets their alarm, tells those that wait for the end of one
  accepted_goals,   // of an action server, on their way to its callback: triggers that
  simulated_clock,  // tells those that listen to jumps
  node,             // what it has: entities' owners, listeners
  leaf,
};
inline constexpr int kLockRanks = static_cast<int>(LockRank::leaf) + 1;

}  // namespace takt

#endif  // TAKT_BASE_LOCK_ORDER_HPP_
