// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/wait_backend.hpp"

#include <string>

#include "takt/executors/wait_backends/manual.hpp"

namespace takt {

WaitBackendRegistry& wait_backends() {
  static WaitBackendRegistry registry("wait back end");
  return registry;
}

namespace {

std::string cheapest_that_serves(std::size_t workers, bool has_file_descriptors) {
  std::string best;
  int least = 0;
  for (const std::string& name : wait_backends().names()) {
    const WaitBackendTraits traits = wait_backends().traits(name);
    const bool serves = traits.cost && workers <= traits.max_workers &&
                        (traits.serves_file_descriptors || !has_file_descriptors);
    if (!serves || (!best.empty() && *traits.cost >= least)) continue;
    best = name;
    least = *traits.cost;
  }
  return best;
}

}  // namespace

void check_wait_backend(std::string_view name) {
  if (name != kAutoWait) wait_backends().check(name);
}

std::unique_ptr<WaitBackend> make_wait_backend(std::string_view name, Clock& clock,
                                               std::size_t workers, bool has_file_descriptors) {
  check_wait_backend(name);
  if (ManualClock* manual = clock.as_manual()) {
    if (name == kAutoWait) return std::make_unique<ManualWaitBackend>(*manual, workers);
    throw Error("'" + std::string(name) + "' cannot wait for a manual clock", "leave `wait` out");
  }
  if (name != kAutoWait) return wait_backends().make(name, workers);
  return wait_backends().make(cheapest_that_serves(workers, has_file_descriptors), workers);
}

}  // namespace takt
