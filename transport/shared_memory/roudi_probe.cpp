// The protocol, of iceoryx 2.0, in datagrams of words with a comma after each:
//   1. REG,NAME,PID,USER,NUMBER,VERSION  to /tmp/roudi; the answer goes to /tmp/NAME
//   2. REG_ACK,…                         from RouDi
//   3. TERMINATION,NAME
//   4. TERMINATION_ACK
// RouDi handles both under the lock that its other thread holds while it joins publishers to
// subscriptions. So no answer comes when either thread hangs.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <iceoryx_posh/internal/runtime/ipc_interface_base.hpp>
#include <iceoryx_posh/version/version_info.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "takt/transport/shared_memory/roudi.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using SteadyTime = std::chrono::steady_clock::time_point;
using iox::runtime::IpcMessageType;

constexpr auto kAnswerLimit = 1500ms;

int milliseconds_to(SteadyTime limit) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(limit - std::chrono::steady_clock::now());
  return static_cast<int>(std::max(left, 0ms).count());
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

class Probe {
 public:
  ~Probe() {
    if (owner_ == getpid()) reset();
  }

  bool answers(std::uint64_t identity) {
    const std::lock_guard lock(mutex_);
    if (owner_ != getpid()) socket_ = -1;  // in a child, the socket is the parent's
    if (owner_ != getpid() || identity != identity_) reset();
    owner_ = getpid();
    identity_ = identity;
    const SteadyTime limit = std::chrono::steady_clock::now() + (is_silent_ ? 0ms : kAnswerLimit);
    is_silent_ = !(socket_ >= 0 || register_at_roudi(limit)) || !receive_answer(limit);
    return !is_silent_;
  }

 private:
  void reset() {
    if (socket_ >= 0) {
      close(socket_);
      unlink(path().c_str());
    }
    socket_ = -1;
    is_registered_ = is_silent_ = false;
  }

  std::string name() const { return fmt::format("iceoryx_rt_{}_takt", owner_); }
  std::string path() const { return "/tmp/" + name(); }

  bool register_at_roudi(SteadyTime limit) {
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const sockaddr_un address = address_of(path());
    unlink(address.sun_path);  // of a killed process with the same process id
    if (socket_ < 0 ||
        bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      return false;
    }
    const auto version =
        static_cast<iox::cxx::Serialization>(iox::version::VersionInfo::getCurrentVersion());
    const std::string words =
        fmt::format("{},{},{},1,{}", name(), owner_, geteuid(), version.toString());
    if (send_to_roudi(IpcMessageType::REG, words, limit)) return true;
    reset();
    return false;
  }

  /// Uses a socket of its own: a connected one receives only from the address that it sends to, and
  /// RouDi answers from another one.
  static bool send_to_roudi(IpcMessageType type, const std::string& words, SteadyTime limit) {
    const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const sockaddr_un address = address_of(kRoudiSocket);
    const std::string text = fmt::format("{},{},", static_cast<int>(type), words);
    pollfd room{socket, POLLOUT, 0};
    const bool is_sent =
        connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
        poll(&room, 1, milliseconds_to(limit)) == 1 &&
        send(socket, text.c_str(), text.size() + 1, MSG_NOSIGNAL) > 0;
    close(socket);
    return is_sent;
  }

  bool receive_answer(SteadyTime limit) {
    std::array<char, 4096> message{};
    for (pollfd readable{socket_, POLLIN, 0}; poll(&readable, 1, milliseconds_to(limit)) == 1;) {
      const ssize_t size = recv(socket_, message.data(), message.size(), 0);
      const std::string_view text(message.data(),
                                  static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
      if (!is_registered_ && is(text, IpcMessageType::REG_ACK)) {
        is_registered_ = true;
        limit = std::chrono::steady_clock::now() + kAnswerLimit;
        send_to_roudi(IpcMessageType::TERMINATION, name(), limit);
      } else if (is(text, IpcMessageType::TERMINATION_ACK)) {
        reset();
        return true;
      }
    }
    return false;
  }

  static bool is(std::string_view text, IpcMessageType type) {
    return text.starts_with(fmt::format("{},", static_cast<int>(type)));
  }

  std::mutex mutex_;
  pid_t owner_ = 0;
  std::uint64_t identity_ = 0;
  int socket_ = -1;  // receives the answers
  bool is_registered_ = false;
  bool is_silent_ = false;
};

}  // namespace

bool roudi_answers(std::uint64_t identity) {
  static Probe probe;
  return probe.answers(identity);
}

}  // namespace takt
