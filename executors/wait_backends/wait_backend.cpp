// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/wait_backend.hpp"

#include <chrono>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "takt/base/library.hpp"
#include "takt/base/returns_in_time.hpp"
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

// Tries what each dispatch relies on: a post ends one wait, also if it came before.
void try_wait_backend(const std::string& name, const WaitBackendRegistry::Entry& entry) {
  const auto backend = entry.factory(1);
  backend->prepare();
  backend->enter(0, {});
  for (const bool is_posted : {false, true, false}) {
    if (is_posted) backend->post();
    if (backend->wait(0, Clock::steady().now()) == is_posted) continue;
    throw Error(fmt::format("wait back end '{}' {}", name,
                            is_posted ? "loses a post" : "returns a post that never came"),
                "each post ends one wait, also if it came before");
  }
  backend->leave(0);
}

void try_in_time(const std::string& name, const WaitBackendRegistry::Entry& entry) {
  constexpr Nanoseconds kLimit = std::chrono::seconds(5);
  if (name == kAutoWait) throw Error("the name 'auto' means Takt's choice", "register another one");
  if (returns_in_time([name, entry] { try_wait_backend(name, entry); }, kLimit)) return;
  throw Error(fmt::format("wait back end '{}' has not returned for {}", name, to_string(kLimit)),
              "return from `wait` when its deadline has come, or a post");
}

}  // namespace

bool register_wait_backend(std::string name, WaitBackendRegistry::Entry entry,
                           const char* version) {
  return register_in(wait_backends(), std::move(name), std::move(entry), version);
}

void load_wait_backend(const std::string& name, const std::string& library) {
  load_registered(wait_backends(), name, library, [&](const auto& entry) {
    try {
      try_in_time(name, entry);
    } catch (const Error&) {
      throw;
    } catch (...) {
      throw Error(
          fmt::format("wait back end '{}' throws: {}", name, text_of(std::current_exception())),
          "let it throw takt::Error where the kernel does not grant it, and nothing else");
    }
  });
}

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
