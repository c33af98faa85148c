// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/lttng.hpp"

#include <cstdlib>
#include <exception>
#include <string_view>
#include <thread>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/tracepoints.hpp"

namespace takt {
namespace {

bool is_asked_by_environment() {
  const char* const value = std::getenv("TAKT_LTTNG");
  if (value == nullptr || *value == '\0') return false;
  if (std::string_view(value) == "1") return true;
  throw Error(fmt::format("TAKT_LTTNG is '{}'", printable(value)),
              "write 1 for tracepoints, or leave it out");
}

}  // namespace

std::string load_tracepoints_if_asked(const SystemDescription* system) {
  if (tracepoints() != nullptr) return {};  // loaded before, by the program
  const ThreadDescription* const thread =
      system != nullptr ? find_thread(*system, "lttng") : nullptr;
  if (!is_asked_by_environment() && thread == nullptr) return {};
  std::string refused;
  std::exception_ptr error;
  // LTTng's threads inherit the attributes of the thread that creates them.
  std::thread maker([&] {
    try {
      if (thread != nullptr) refused = apply(thread->attributes, system->realtime).refused;
      load_tracepoints();
    } catch (...) {
      error = std::current_exception();
    }
  });
  maker.join();
  if (error != nullptr) std::rethrow_exception(error);
  return refused;
}

}  // namespace takt
