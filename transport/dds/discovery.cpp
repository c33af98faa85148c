// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/discovery.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// Limit: hosts in `ROS_STATIC_PEERS`. At it: the process does not start. Seen: the error.
constexpr std::size_t kMostPeers = 100;

std::string_view environment(const char* name) {
  const char* const text = std::getenv(name);
  return text == nullptr ? "" : text;
}

bool is_localhost_only() {
  return environment("ROS_LOCALHOST_ONLY") == "1";
}

bool belongs_to_an_address(char character) {
  return std::isalnum(static_cast<unsigned char>(character)) != 0 ||
         std::string_view(".:-_[]").find(character) != std::string_view::npos;
}

}  // namespace

DiscoveryRange default_discovery() {
  if (is_localhost_only()) return DiscoveryRange::localhost;
  constexpr char kName[] = "ROS_AUTOMATIC_DISCOVERY_RANGE";
  const std::string_view range = environment(kName);
  if (range.empty() || range == "LOCALHOST") return DiscoveryRange::localhost;
  if (range == "SUBNET") return DiscoveryRange::subnet;
  if (range == "OFF") return DiscoveryRange::off;
  if (range == "SYSTEM_DEFAULT") return DiscoveryRange::system;
  throw Error(fmt::format("{} is '{}'", kName, range),
              "set it to LOCALHOST, SUBNET, OFF or SYSTEM_DEFAULT");
}

std::vector<std::string> default_static_peers() {
  std::vector<std::string> peers;
  if (is_localhost_only()) return peers;
  constexpr char kName[] = "ROS_STATIC_PEERS";
  for (std::string_view rest = environment(kName); !rest.empty();) {
    const std::string_view peer = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(rest.size(), peer.size() + 1));
    if (peer.empty()) continue;
    if (!std::all_of(peer.begin(), peer.end(), belongs_to_an_address)) {
      throw Error(fmt::format("'{}' in {} is not an address", peer, kName),
                  "separate names or numbers of hosts by semicolons");
    }
    if (peers.size() == kMostPeers) {  // each is looked up
      throw Error(fmt::format("{} names more than {} hosts", kName, kMostPeers),
                  "name those that you need");
    }
    peers.emplace_back(peer);
  }
  return peers;
}

}  // namespace takt
