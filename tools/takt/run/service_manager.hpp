// What a service tells the service manager that has started it, as sd_notify(3) says.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SERVICE_MANAGER_HPP_
#define TAKT_TOOLS_TAKT_SERVICE_MANAGER_HPP_

#include <string_view>

#include "takt/base/time.hpp"

namespace takt::tools {

/// From its construction, a service is READY; from its destruction, it is STOPPING. What no service
/// manager has started tells nobody.
class ServiceManager {
 public:
  ServiceManager();
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// Says that this thread goes on, if the service manager restarts what does not say so in time.
  /// Returns the time until the next call.
  Nanoseconds go_on(TimePoint now);

 private:
  static void say(std::string_view state);

  const Nanoseconds step_;  // between two calls; zero: nobody waits for them
  TimePoint next_ = kNever;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SERVICE_MANAGER_HPP_
