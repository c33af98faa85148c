// A library of executors and wait back ends, good ones and bad ones, for executor_library_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>

#include "takt/base/version.hpp"
#ifdef TAKT_TEST_OLD
#undef TAKT_VERSION
#define TAKT_VERSION "0.0.1"
#endif
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace {

template <class Thrown>
bool register_broken(const char* name, Thrown thrown) {
  const auto make = [thrown](const takt::ExecutorOptions&) -> std::unique_ptr<takt::Executor> {
    throw thrown;
  };
  return takt::register_executor(name, {"for tests", make, {}}, TAKT_VERSION);
}
[[maybe_unused]] const bool kBroken =
    register_broken("never_made", std::runtime_error("out of order")) &&
    register_broken("never_made_either", 42);

// Executors made by a function instead of from their traits.
std::unique_ptr<takt::Executor> make_by_hand(const takt::ExecutorOptions& options) {
  return takt::executors().make("events", options);
}
[[maybe_unused]] const bool kByHand =
    takt::register_executor("by_hand", {"for tests", make_by_hand, {}}, TAKT_VERSION) &&
    takt::register_executor("of_the_engine", {"for tests", make_by_hand, {.simulated = true}},
                            TAKT_VERSION);

struct LastCome {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return a.sequence > b.sequence;
  }
};

struct Never : takt::WaitBackend {
  explicit Never(std::size_t) {}
  bool wait(std::size_t, takt::TimePoint) noexcept override { return false; }
  void post() noexcept override {}
};

struct Always : Never {
  using Never::Never;
  bool wait(std::size_t, takt::TimePoint) noexcept override { return true; }
};

struct Hangs : Never {
  using Never::Never;
  bool wait(std::size_t, takt::TimePoint) noexcept override {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
  }
};

struct Open : takt::Rule {
  explicit Open(const takt::ExecutorOptions&) {}
};

struct AllWorkers : takt::WorkersPolicy {
  explicit AllWorkers(const takt::ExecutorOptions&) {}
  takt::WorkerSet workers_of(const takt::NamedCallback&,
                             std::span<const takt::ThreadAttributes> workers) const override {
    return (takt::WorkerSet{1} << workers.size()) - 1;
  }
};

}  // namespace

TAKT_REGISTER_EXECUTOR("with_a_rule", "for tests", .readiness = takt::Readiness::events,
                       .scheduler = "fifo", .rule = takt::make_rule<Open>)
TAKT_REGISTER_EXECUTOR("with_bands", "for tests", .readiness = takt::Readiness::events,
                       .scheduler = "fifo", .max_threads = 2,
                       .workers = takt::make_workers_policy<AllWorkers>)
TAKT_REGISTER_EXECUTOR("sound", "every event at once, for two threads",
                       .readiness = takt::Readiness::events, .scheduler = "fifo", .max_threads = 2,
                       .pool = true)
TAKT_REGISTER_EXECUTOR("also_sound", "for tests")
TAKT_REGISTER_SCHEDULER("its_own", "for tests", takt::HeapScheduler<LastCome>)
TAKT_REGISTER_EXECUTOR("of_its_scheduler", "for tests", .scheduler = "its_own")
TAKT_REGISTER_EXECUTOR("events", "for tests")
TAKT_REGISTER_EXECUTOR("twice", "for tests")
TAKT_REGISTER_EXECUTOR("twice", "for tests")
TAKT_REGISTER_WAIT_BACKEND("never", "for tests", Never)
TAKT_REGISTER_WAIT_BACKEND("always", "for tests", Always)
TAKT_REGISTER_WAIT_BACKEND("hangs", "for tests", Hangs)
TAKT_REGISTER_WAIT_BACKEND("futex", "for tests", Never)
TAKT_REGISTER_WAIT_BACKEND("auto", "for tests", Never)
