// The main function of the benchmarks: as Google Benchmark's, but fails if output cannot be
// written.
// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include <benchmark/benchmark.h>

#include "takt/measuring/output.hpp"

int main(int argc, char** argv) {
  takt::rt::guard_output();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  std::cout.flush();
  return takt::rt::checked_output(std::cout.good() ? 0 : 1);
}
