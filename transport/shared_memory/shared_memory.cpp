// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/shared_memory/shared_memory.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/transport/shared_memory/roudi.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDefaultConfiguration = "/etc/iceoryx/roudi_config.toml";
constexpr std::size_t kDefaultLargestChunk = std::size_t{4} << 20;  // without a configuration file
// Limit: bytes of RouDi's configuration file. At it: its pools are not known, and messages go by
// UDP. Seen: the reason in the result.
constexpr std::size_t kMostConfigurationBytes = 1 << 20;

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The largest `size` in a configuration file; nullopt: there is no such file, or it has segments
/// for groups of users.
std::optional<std::size_t> largest_chunk(const fs::path& configuration) {
  std::istringstream file;
  try {  // untrusted input: another process names it
    file.str(read_text(configuration.string(), kMostConfigurationBytes));
  } catch (const Error&) {
    return std::nullopt;
  }
  std::optional<std::size_t> largest;
  for (std::string line; std::getline(file, line);) {
    std::size_t size = 0;
    if (std::sscanf(line.c_str(), " size = %zu", &size) == 1) {
      largest = std::max(largest.value_or(0), size);
    }
    std::array<char, 7> word{};
    if (std::sscanf(line.c_str(), " %6[a-z] =", word.data()) == 1 &&
        (std::string_view(word.data()) == "reader" || std::string_view(word.data()) == "writer")) {
      return std::nullopt;
    }
  }
  return largest;
}

/// The value of an option in RouDi's syntax: "-c FILE", "-cFILE", "--config-file=FILE", ….
std::optional<std::string> option(const std::vector<std::string>& words, const std::string& brief,
                                  const std::string& full) {
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] == brief || words[i] == full) {
      return i + 1 < words.size() ? words[i + 1] : std::string();
    }
    if (words[i].starts_with(full + "=")) return words[i].substr(full.size() + 1);
    if (words[i].starts_with(brief)) return words[i].substr(brief.size());
  }
  return std::nullopt;
}

/// Reads RouDi's command line: the size of its largest chunk, and whether its options permit its
/// use.
void look_at_options(Roudi& roudi) {
  const fs::path process = fmt::format("/proc/{}", roudi.pid);
  if (read_file(process / "comm") != "iox-roudi\n") {
    roudi.unusable = "RouDi's pools are not known: it is not an iox-roudi";
    return;
  }
  const std::string line = read_file(process / "cmdline");
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < line.size(); begin += words.back().size() + 1) {
    words.emplace_back(line.c_str() + begin);
  }
  if (option(words, "-m", "--monitoring-mode") != "off") {
    roudi.unusable =
        "RouDi watches its clients, so that they abort after they were stopped for two seconds; "
        "start it by `iox-roudi -m off`";
    return;
  }
  std::error_code ignored;
  const fs::path folder = fs::read_symlink(process / "cwd", ignored);
  std::optional<std::size_t> largest = kDefaultLargestChunk;
  if (const auto file = option(words, "-c", "--config-file")) {
    largest = largest_chunk(folder / *file);
  } else if (fs::exists(kDefaultConfiguration)) {
    largest = largest_chunk(kDefaultConfiguration);
  }
  if (!largest) {
    roudi.unusable =
        "RouDi's pools are not known: we cannot read its configuration file, or it "
        "has segments for groups of users";
    return;
  }
  roudi.largest_message = *largest - std::min(kChunkOverhead, *largest);
}

bool accepts_connections(const char* path) {
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  const bool accepts =
      connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(socket);
  return accepts;
}

}  // namespace

pid_t holder_of_roudi_lock() {
  struct stat lock {};
  if (stat(kRoudiLock, &lock) != 0) return 0;
  // "1: FLOCK  ADVISORY  WRITE 18534 fe:00:10954230 0 EOF"
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    int pid = 0;
    unsigned long inode = 0;
    if (std::sscanf(line.c_str(), "%*s FLOCK %*s WRITE %d %*x:%*x:%lu", &pid, &inode) == 2 &&
        inode == lock.st_ino) {
      return pid;
    }
  }
  return 0;
}

std::size_t shared_memory_bytes() noexcept {
  std::error_code failed;
  std::size_t bytes = 0;
  for (std::filesystem::directory_iterator file("/dev/shm", failed), end; !failed && file != end;
       file.increment(failed)) {
    std::error_code gone;
    if (const std::uintmax_t size = file->file_size(gone); !gone) bytes += size;
  }
  return bytes;
}

Roudi find_roudi() {
  Roudi roudi;
  const auto unusable = [&](std::string why) {
    roudi.unusable = std::move(why);
    return roudi;
  };
  struct stat socket {};
  roudi.pid = holder_of_roudi_lock();
  if (roudi.pid == 0 || stat(kRoudiSocket, &socket) != 0) return unusable("RouDi is not running");
  // RouDi of another user cannot answer us, and we would wait for ever.
  if (socket.st_uid != geteuid() || socket.st_gid != getegid()) {
    return unusable(fmt::format("RouDi belongs to user {} and group {}, and we to {} and {}",
                                socket.st_uid, socket.st_gid, geteuid(), getegid()));
  }
  if (!accepts_connections(kRoudiSocket) || !fs::exists(kRoudiManagement)) {
    return unusable("RouDi does not serve");
  }
  // "18534 (iox-roudi) S 1 …": T and t are stopped.
  const std::string state = read_file(fmt::format("/proc/{}/stat", roudi.pid));
  const std::size_t name_end = state.rfind(')');
  if (name_end != std::string::npos && std::tolower(state[name_end + 2]) == 't') {
    return unusable("RouDi is stopped");
  }
  look_at_options(roudi);
  if (!roudi.unusable.empty()) return roudi;
  // FNV-1a, 64 bits.
  roudi.identity = 0xcbf29ce484222325;
  for (const char character : read_file("/proc/sys/kernel/random/boot_id") +
                                  fmt::format("{} {} {}.{}", roudi.pid, socket.st_ino,
                                              socket.st_ctim.tv_sec, socket.st_ctim.tv_nsec)) {
    roudi.identity = (roudi.identity ^ static_cast<unsigned char>(character)) * 0x100000001b3;
  }
  roudi.is_silent = !roudi_answers(roudi.identity);
  if (roudi.is_silent) {
    unusable(fmt::format("RouDi does not answer: end it by `kill -9 {}`", roudi.pid));
  }
  return roudi;
}

}  // namespace takt
