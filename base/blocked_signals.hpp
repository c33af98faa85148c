// Signals are for the threads of a program, not for those that Takt starts beside them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_BLOCKED_SIGNALS_HPP_
#define TAKT_BASE_BLOCKED_SIGNALS_HPP_

#include <csignal>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// While an object lives, the calling thread takes no signal, and a thread that it starts never
/// does: the program may await signals in a thread of its own, having blocked them in the others.
/// Thread safety: an object belongs to the thread that made it. Real-time: yes.
class BlockedSignals {
 public:
  BlockedSignals() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~BlockedSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace takt

#endif  // TAKT_BASE_BLOCKED_SIGNALS_HPP_
