// SPDX-License-Identifier: Apache-2.0
#include "takt/base/held_locks.hpp"

#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>

namespace takt::detail {

#ifdef TAKT_CHECK_LOCKS
namespace {

constexpr std::array<const char*, kLockRanks> kNames = {
    "bound_watch",  "isolated",        "callback_lists",  "observer",      "wait_set",
    "parameters",   "time_source",     "action_server",   "all_outputs",   "outputs",
    "topics",       "dispatch",        "managed",         "history",       "responses",
    "status_event", "awaited_message", "client_alarm",    "kept_requests", "calls",
    "tasks",        "accepted_goals",  "simulated_clock", "node",          "leaf"};
static_assert(kNames.back() != nullptr);

const char* innermost(std::uint32_t held) noexcept {
  return kNames[static_cast<std::size_t>(std::bit_width(held) - 1)];
}

}  // namespace

void refuse_lock_order(LockRank wanted) noexcept {
  std::fprintf(stderr, "takt: lock '%s' is wanted while '%s' is held; see base/lock_order.hpp\n",
               kNames[static_cast<std::size_t>(wanted)], innermost(held_locks));
  std::abort();
}

void refuse_held_lock(const char* what) noexcept {
  std::fprintf(stderr, "takt: a user's %s is called or destroyed under a lock of Takt, '%s'\n",
               what, innermost(held_locks));
  std::abort();
}
#endif

}  // namespace takt::detail
