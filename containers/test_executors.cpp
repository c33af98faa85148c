// A library of executors, good ones and bad ones, for executor_library_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "takt/base/version.hpp"
#ifdef TAKT_TEST_OLD
#undef TAKT_VERSION
#define TAKT_VERSION "0.0.1"
#endif
#include "takt/executors/engine/dispatching_executor.hpp"

namespace {

struct NeverMade : takt::DispatchingExecutor {
  NeverMade(const takt::ExecutorOptions& options, const takt::ExecutorTraits& traits)
      : DispatchingExecutor(options, traits) {
    throw std::runtime_error("out of order");
  }
};

struct NeverMadeEither : takt::DispatchingExecutor {
  NeverMadeEither(const takt::ExecutorOptions& options, const takt::ExecutorTraits& traits)
      : DispatchingExecutor(options, traits) {
    throw 42;
  }
};

struct LastCome {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return a.sequence > b.sequence;
  }
};

}  // namespace

TAKT_REGISTER_EXECUTOR("sound", "every event at once, for two threads", takt::DispatchingExecutor,
                       .readiness = takt::Readiness::events, .scheduler = "fifo", .max_threads = 2,
                       .pool = true)
TAKT_REGISTER_EXECUTOR("also_sound", "for tests", takt::DispatchingExecutor)
TAKT_REGISTER_SCHEDULER("its_own", "for tests", takt::HeapScheduler<LastCome>)
TAKT_REGISTER_EXECUTOR("of_its_scheduler", "for tests", takt::DispatchingExecutor,
                       .scheduler = "its_own")
TAKT_REGISTER_EXECUTOR("never_made", "for tests", NeverMade)
TAKT_REGISTER_EXECUTOR("never_made_either", "for tests", NeverMadeEither)
TAKT_REGISTER_EXECUTOR("events", "for tests", takt::DispatchingExecutor)
TAKT_REGISTER_EXECUTOR("twice", "for tests", takt::DispatchingExecutor)
TAKT_REGISTER_EXECUTOR("twice", "for tests", takt::DispatchingExecutor)
