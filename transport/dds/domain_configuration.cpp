// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/domain_configuration.hpp"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/transport/dds/ports.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

bool is_free(int port) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // Cyclone will report the reason
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool is_free = bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  close(fd);
  return is_free;
}

// `kind`: IFF_LOOPBACK; 0: an interface that Cyclone could choose besides loopback.
bool is_interface_up(unsigned kind) {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return false;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> interfaces(first, freeifaddrs);
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET &&
        (each->ifa_flags & (IFF_UP | IFF_LOOPBACK)) == (IFF_UP | kind)) {
      return true;
    }
  }
  return false;
}

// The peers on this machine, by their ports. Not our own port, and not the ports by which Takt's
// processes hear newcomers, which make no use of our announcements.
std::string peers(const DdsOptions& options, int participant_index) {
  std::string own;
  for (int index = 0; index < kIndices; ++index) {
    if ((index >= kFirstHeard && index <= kLastHeard) || index == participant_index) continue;
    own += fmt::format("{}127.0.0.1:{}", own.empty() ? "" : ",",
                       discovery_port(options.domain, index));
  }
  std::string xml = fmt::format(R"(<Peer address="{}"/>)", own);
  for (const std::string& peer : options.static_peers) {
    xml += fmt::format(R"(<Peer address="{}"/>)", peer);
  }
  return xml;
}

// Messages on one machine use the loopback interface, which works without a network. Yet processes
// of ROS 2 recognise their own machine only by an address of the network. Cyclone 0.10 sends to all
// peers through its first interface, and through loopback it does not reach peers on other
// machines.
std::string interfaces(const DdsOptions& options) {
  const bool is_local = options.discovery == DiscoveryRange::localhost;
  if (!is_local && options.discovery != DiscoveryRange::off &&
      options.discovery != DiscoveryRange::lo) {
    return {};
  }
  return fmt::format(
      R"(<Interfaces><NetworkInterface name="lo" multicast="false" priority="{}"/>{}</Interfaces><AllowMulticast>false</AllowMulticast>)",
      options.static_peers.empty() ? 1 : -1,
      is_local && is_interface_up(0) ? R"(<NetworkInterface autodetermine="true"/>)" : "");
}

/// The tag of a process that discovers no other.
std::string tag() {
  return fmt::format("_off_{}", getpid());
}

std::string discovery(const DdsOptions& options, int participant_index) {
  switch (options.discovery) {
    case DiscoveryRange::off:
      return fmt::format("<ParticipantIndex>none</ParticipantIndex><Tag>takt{}</Tag>", tag());
    case DiscoveryRange::system:
      return {};
    default:
      break;
  }
  return fmt::format(
      "<ParticipantIndex>{}</ParticipantIndex><MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>"
      "<Peers>{}</Peers>",
      participant_index, kIndices, peers(options, participant_index));
}

/// The value of CYCLONEDDS_URI: files or XML, separated by commas. Throws Error for a file that is
/// not a regular one: Cyclone would wait for ever for the writer of a FIFO.
std::string configuration_of_user() {
  const char* const text = std::getenv("CYCLONEDDS_URI");
  if (text == nullptr) return {};
  constexpr std::string_view kScheme = "file://";
  for (std::string_view rest = text;;) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n,"), rest.size()));
    if (rest.empty() || rest.front() == '<') return text;
    std::string_view file = rest.substr(0, rest.find(','));
    rest.remove_prefix(file.size());
    if (file.starts_with(kScheme)) file.remove_prefix(kScheme.size());
    if (file.find('$') != std::string_view::npos) continue;  // Cyclone expands variables
    try {
      const RegularFile readable{std::string(file)};
    } catch (const Error& error) {
      throw Error(error.what(), "", fmt::format("CYCLONEDDS_URI: {}", file));
    }
  }
}

}  // namespace

bool has_data_thread(const DdsOptions& options) {
  if (std::getenv("CYCLONEDDS_URI") != nullptr) return false;  // may choose other interfaces
  switch (options.discovery) {
    case DiscoveryRange::off:
    case DiscoveryRange::lo:
      return true;
    case DiscoveryRange::localhost:
      return options.static_peers.empty();
    default:
      return false;
  }
}

bool is_loopback_up() {
  return is_interface_up(IFF_LOOPBACK);
}

std::optional<int> free_participant_index(const DdsOptions& options) {
  const auto first_free = [&](int from, int to, int step) -> std::optional<int> {
    for (int index = from; index != to + step; index += step) {
      const int port = discovery_port(options.domain, index);
      if (is_free(port) && is_free(port + 1)) return index;
    }
    return std::nullopt;
  };
  std::optional<int> index = first_free(kLastOfRos2 + 1, kIndices - 1, 1);
  if (!index) index = first_free(kLastOfRos2, kLastHeard + 1, -1);
  return index ? index : first_free(kFirstHeard - 1, 0, -1);
}

// Lean, deterministic, and messages up to the size of a datagram in one piece.
// docs/explanation/decisions/0032_settings_of_cyclone_are_measured.md has the effect of each
// setting. The lease: after it, a killed process is noticed. Within four fifths of it, Cyclone
// wakes twice, to announce the participant and its liveliness: so an idle process wakes 0.83 times
// a second.
std::string domain_configuration(const DdsOptions& options, int participant_index,
                                 std::uint64_t roudi) {
  return fmt::format(
      R"(<CycloneDDS><Domain id="any"><General>{}<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General>)"
      R"(<Discovery>{}<LeaseDuration>3s</LeaseDuration></Discovery>)"
      R"(<Internal><SocketReceiveBufferSize min="default" max="10MB"/><Watermarks><WhcHigh>16MB</WhcHigh></Watermarks></Internal></Domain></CycloneDDS>,)"
      R"({},)"
      R"(<CycloneDDS><Domain id="any"><Internal><MultipleReceiveThreads>{}</MultipleReceiveThreads></Internal><SharedMemory>{}</SharedMemory></Domain></CycloneDDS>)",
      interfaces(options), discovery(options, participant_index), configuration_of_user(),
      has_data_thread(options),
      shared_memory_settings(roudi,
                             fmt::format("takt_{}{}", options.domain,
                                         options.discovery == DiscoveryRange::off ? tag() : "")));
}

}  // namespace takt
