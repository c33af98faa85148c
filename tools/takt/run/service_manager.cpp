// SPDX-License-Identifier: Apache-2.0
#include "run/service_manager.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "takt/base/clock.hpp"

namespace takt::tools {
namespace {

/// 0 where it is no such number.
std::uint64_t number_in(const char* text) {
  std::uint64_t number = 0;
  if (text == nullptr) return 0;
  const char* const end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, number);
  return error == std::errc() && rest == end ? number : 0;
}

/// Twice as often as is asked for; zero: never. A watchdog of another process is none of this one.
Nanoseconds watchdog_step() {
  const char* const process = std::getenv("WATCHDOG_PID");
  const std::uint64_t limit_us = number_in(std::getenv("WATCHDOG_USEC"));
  if (limit_us == 0 ||
      (process != nullptr && number_in(process) != static_cast<std::uint64_t>(getpid()))) {
    return Nanoseconds::zero();
  }
  // At most a thousand times a second; and a day, with which nothing overflows.
  return std::chrono::microseconds(std::clamp<std::uint64_t>(limit_us / 2, 1'000, 86'400'000'000));
}

}  // namespace

ServiceManager::ServiceManager() : step_(watchdog_step()) {
  if (step_ != Nanoseconds::zero()) next_ = Clock::steady().now();
  say("READY=1");
}

ServiceManager::~ServiceManager() {
  say("STOPPING=1");
}

Nanoseconds ServiceManager::go_on(TimePoint now) {
  if (now >= next_) {
    say("WATCHDOG=1");
    next_ = later(now, step_);
  }
  return between(now, next_);
}

/// One datagram. Nothing here depends on whether it is heard.
void ServiceManager::say(std::string_view state) {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t size = path == nullptr ? 0 : std::strlen(path);
  if (size < 2 || size >= sizeof(address.sun_path)) return;
  std::memcpy(address.sun_path, path, size);
  if (path[0] == '@') address.sun_path[0] = '\0';  // an abstract name
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return;
  sendto(socket, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
         reinterpret_cast<const sockaddr*>(&address),
         static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + size));
  close(socket);
}

}  // namespace takt::tools
