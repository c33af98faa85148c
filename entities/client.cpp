// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/client.hpp"

#include <random>

namespace takt {

// Unique on the whole network with all likelihood that one needs: 63 random bits, and never 0.
std::uint64_t new_client_id() {
  std::random_device random;
  return (std::uint64_t{random()} << 32 | random()) | 1;
}

}  // namespace takt
