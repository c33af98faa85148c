// SPDX-License-Identifier: Apache-2.0
#include "run/constructor_exit.hpp"

#include <cstdlib>
#include <string>
#include <string_view>

#include <unistd.h>

#include "takt/base/never_destroyed.hpp"
#include "takt/measuring/output.hpp"

#include "exit_status.hpp"

namespace takt::tools {
namespace {

/// Outlives what exit() destroys.
std::string& constructed() {
  static detail::NeverDestroyed<std::string> name;
  return *name;
}

void at_exit() {
  if (constructed().empty()) return;
  rt::to_stderr(
      "takt: the constructor of '{}' called exit(); a constructor may throw, but not exit\n",
      constructed());
  _exit(kFailed);
}

}  // namespace

ContainerOverrides reports_exit() {
  constructed().clear();  // it is there before the handler, which may then use it
  [[maybe_unused]] static const int registered = std::atexit(at_exit);
  return {.on_making = [](std::string_view component) { constructed() = component; },
          .only_constructs = true};
}

}  // namespace takt::tools
