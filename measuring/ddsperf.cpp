// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/ddsperf.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

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

void for_each_line(const std::string& command, const std::function<void(const std::string&)>& use,
                   int end) {
  // A second shell waits until this process closes its end of the input, which it also does when it
  // is killed, and then kills all.
  const std::string script = fmt::format(
      "export CYCLONEDDS_URI='{}'; exec 3<&0; (read end <&3; kill -9 0) >/dev/null 2>&1 & "
      "({}); kill -9 0",
      kLoopback, command);
  std::array<int, 2> input{}, output{};
  if (pipe2(input.data(), O_CLOEXEC) != 0 || pipe2(output.data(), O_CLOEXEC) != 0) {
    throw Error("cannot create a pipe: " + errno_message(errno));
  }
  const pid_t shell = fork();
  if (shell < 0) throw Error("cannot start '" + command + "': " + errno_message(errno));
  if (shell == 0) {
    setpgid(0, 0);  // away from Ctrl-C, and to be killed together
    dup2(input[0], STDIN_FILENO), dup2(output[1], STDOUT_FILENO);
    execl("/bin/sh", "sh", "-c", script.c_str(), nullptr);
    _exit(127);
  }
  close(input[0]), close(output[1]);
  std::string text;
  std::array<char, 4096> part{};
  for (;;) {
    std::array<pollfd, 2> events{{{output[0], POLLIN, 0}, {end, POLLIN, 0}}};
    poll(events.data(), events.size(), -1);
    if (events[1].revents != 0) break;
    const ssize_t size = read(output[0], part.data(), part.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    text.append(part.data(), static_cast<std::size_t>(size));
    for (std::size_t at; (at = text.find('\n')) != text.npos; text.erase(0, at + 1)) {
      use(text.substr(0, at));
    }
  }
  close(input[1]), close(output[0]);
  waitpid(shell, nullptr, 0);
}

}  // namespace takt::rt
