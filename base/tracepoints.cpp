// SPDX-License-Identifier: Apache-2.0
#include "takt/base/tracepoints.hpp"

#include <mutex>
#include <string>

#include <dlfcn.h>
#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/base/version.hpp"

namespace takt {

constinit std::atomic<const Tracepoints*> detail::loaded_tracepoints{nullptr};

void load_tracepoints() {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (tracepoints() != nullptr) return;
  const std::filesystem::path library = path_of_takt().parent_path() / "takt" / "libtakt_lttng.so";
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = handle != nullptr ? dlsym(handle, "takt_tracepoints") : nullptr;
  if (found == nullptr) {
    throw Error(fmt::format("the tracepoints for LTTng cannot be loaded: {}", dlerror()),
                "install the package takt-lttng, or build Takt where liblttng-ust-dev is");
  }
  const auto* const table = reinterpret_cast<const Tracepoints* (*)()>(found)();
  detail::loaded_tracepoints.store(table, std::memory_order_release);
  table->rcl_init(table, TAKT_VERSION);
  // Analysis tools ask for the ROS 2 version, as its tracepoints have changed; these are Iron's.
  table->caret_init(Clock::steady().now().time_since_epoch().count(), "iron");
  table->rmw_implementation("rmw_cyclonedds_cpp");
}

}  // namespace takt
