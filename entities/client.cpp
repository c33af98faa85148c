// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/client.hpp"

#include <random>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"

namespace takt {

// 63 random bits, never 0: so likely to be unique on the whole network that no check is needed.
std::uint64_t new_client_id() {
  std::random_device random;
  return (std::uint64_t{random()} << 32 | random()) | 1;
}

void detail::refuse_call(const std::string& service, std::size_t waiting) {
  throw Error(
      fmt::format("service '{}': {} calls wait for their answers already", service, waiting),
      "wait for some, or give the client more ClientOptions::calls_in_flight");
}

void detail::warn_of_ended_calls(const std::string& service, std::size_t calls) {
  if (static constinit LogThrottle throttle; throttle.may_log()) {
    log(LogLevel::warn, "service '{}': no service can answer; calls that have ended without: {}",
        service, calls);
  }
}

}  // namespace takt
