// The connection between a parent process and a child.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CHANNEL_HPP_
#define TAKT_TOOLS_TAKT_CHANNEL_HPP_

#include <array>
#include <cerrno>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "takt/measuring/json_text.hpp"

namespace takt::tools {

/// Exchanges JSON documents, one per line, over a socket pair.
class Channel {
 public:
  explicit Channel(int fd) : fd_(fd) {}
  ~Channel() { close(fd_); }
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  int fd() const noexcept { return fd_; }

  /// Returns false if the peer has closed the connection.
  bool send(const nlohmann::json& document) {
    const std::string line = rt::json_text(document) + "\n";
    for (std::size_t sent = 0; sent < line.size();) {
      const ssize_t now = ::send(fd_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
      if (now < 0 && errno == EINTR) continue;
      if (now <= 0) return false;
      sent += static_cast<std::size_t>(now);
    }
    return true;
  }
  /// The next received document.
  std::optional<nlohmann::json> next() {
    const std::size_t end = received_.find('\n', looked_at_);
    looked_at_ = end == std::string::npos ? received_.size() : 0;
    if (end == std::string::npos) return std::nullopt;
    nlohmann::json document = rt::parse_json(std::string_view(received_).substr(0, end));
    received_.erase(0, end + 1);
    return document;
  }
  /// Waits for data. Returns false if the peer has closed the connection.
  bool read_some() {
    std::array<char, 65536> buffer;
    for (;;) {
      const ssize_t now = ::read(fd_, buffer.data(), buffer.size());
      if (now < 0 && errno == EINTR) continue;
      if (now > 0) received_.append(buffer.data(), static_cast<std::size_t>(now));
      return now > 0;
    }
  }
  /// Whether there is something to read.
  bool has_more() const {
    pollfd event{fd_, POLLIN, 0};
    return poll(&event, 1, 0) == 1 && (event.revents & POLLIN) != 0;
  }
  std::optional<nlohmann::json> receive() {
    for (;;) {
      if (auto document = next()) return document;
      if (!read_some()) return std::nullopt;
    }
  }
  /// Closes the sending direction; the peer can still send.
  void finish() { shutdown(fd_, SHUT_WR); }

 private:
  const int fd_;
  std::string received_;
  std::size_t looked_at_ = 0;  // so much of it has no line break
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CHANNEL_HPP_
