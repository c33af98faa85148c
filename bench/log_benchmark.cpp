// What does a line of log cost the thread that logs it?
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>

#include <benchmark/benchmark.h>

#include "takt/base/logger.hpp"

namespace takt {
namespace {

/// Lines that wait, or that are dropped, while the writing thread is kept busy: nothing is woken.
void log_lines(benchmark::State& state, std::size_t waiting, std::size_t lines) {
  Logger& logger = Logger::instance();
  std::atomic<bool> is_busy{false}, goes_on{false};
  logger.set_writer([&](LogLevel, std::string_view) {
    is_busy = true;
    is_busy.notify_all();
    goes_on.wait(false);
  });
  for ([[maybe_unused]] const auto iteration : state) {
    is_busy = goes_on = false;
    logger.log(LogLevel::info, "the first");
    is_busy.wait(false);
    for (std::size_t i = 0; i < waiting; ++i) logger.log(LogLevel::info, "more");
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < lines; ++i) {
      logger.log(LogLevel::info, "scan {} took {} us", 17, 250);
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    state.SetIterationTime(taken.count() / static_cast<double>(lines));
    goes_on = true;
    goes_on.notify_all();
    logger.flush();
  }
  logger.set_writer({});
}
BENCHMARK_CAPTURE(log_lines, written, 0, 200)->UseManualTime()->Iterations(100);
BENCHMARK_CAPTURE(log_lines, dropped, Logger::kRecords, 1000)->UseManualTime()->Iterations(100);

}  // namespace
}  // namespace takt
