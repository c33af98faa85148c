// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/ddsperf.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::rt {
namespace {

constexpr const char* kLoopback =
    R"(<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>)";

}  // namespace

std::string why_no_ddsperf() {
  return std::system("command -v ddsperf >/dev/null") == 0
             ? ""
             : "ddsperf is not installed: apt-get install cyclonedds-tools";
}

void keep_ddsperf_on_loopback() {
  setenv("CYCLONEDDS_URI", kLoopback, 1);
}

void for_each_line(const std::string& command, const std::function<void(const std::string&)>& use) {
  FILE* output =
      popen(fmt::format("export CYCLONEDDS_URI='{}'; {}", kLoopback, command).c_str(), "r");
  if (output == nullptr) {
    throw Error("cannot start '" + command + "': " + errno_message(errno));
  }
  std::array<char, 400> line{};
  while (std::fgets(line.data(), line.size(), output) != nullptr) use(line.data());
  pclose(output);
}

}  // namespace takt::rt
