// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/shared_memory.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// iceoryx's own names.
constexpr const char* kSocket = "/tmp/roudi";
constexpr const char* kLock = "/tmp/iox-unique-roudi.lock";
constexpr const char* kManagement = "/dev/shm/iceoryx_mgmt";
constexpr const char* kDefaultConfiguration = "/etc/iceoryx/roudi_config.toml";
constexpr std::size_t kDefaultLargestChunk = std::size_t{4} << 20;  // without any configuration
constexpr std::size_t kManagementBytes = std::size_t{72} << 20;
constexpr std::size_t kMostPools = 32;
constexpr auto kStartLimit = 20s;

// Beside a message, its chunk holds our header, Cyclone's (56 bytes), and room to align them.
constexpr std::size_t kOverhead = sizeof(ChunkHeader) + 128;
constexpr std::size_t chunk_bytes(std::size_t message_bytes) {
  return (message_bytes + kOverhead + 7) / 8 * 8;
}

constexpr std::size_t kMostHeld = 240;               // iceoryx allows 256
constexpr std::size_t kMostQueued = 256;             // iceoryx's limit
constexpr std::size_t kQueuedSmall = 100;            // messages, while they are small: …
constexpr std::size_t kQueuedBytes = 1024UL * 1024;  // … all of them together
constexpr std::size_t kInCallbacks = 8;

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Who holds RouDi's lock: RouDi, while it lives. 0: nobody.
pid_t holder_of_lock() {
  struct stat lock {};
  if (stat(kLock, &lock) != 0) return 0;
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

/// The largest `size` of a configuration file; nullopt: there is none, or it gives its memory to
/// groups of users.
std::optional<std::size_t> largest_chunk(const fs::path& configuration) {
  std::ifstream file(configuration);
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

/// What follows the option, as RouDi takes it: "-c FILE", "-cFILE", "--config-file=FILE", ….
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

/// What it was started with: how large its largest chunk is, and whether it can be used so.
void look_at_options(Roudi& roudi) {
  const fs::path process = fmt::format("/proc/{}", roudi.pid);
  if (read_file(process / "comm") != "iox-roudi\n") {
    roudi.unusable = "RouDi's pools are not known: it is no iox-roudi";
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
  roudi.largest_message = *largest - std::min(kOverhead, *largest);
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

/// At most as many pools as iceoryx allows, in order of size.
std::vector<ChunkPool> arrange(std::vector<ChunkPool> pools) {
  std::sort(pools.begin(), pools.end(),
            [](const auto& a, const auto& b) { return a.message_bytes < b.message_bytes; });
  const auto cost = [&pools](std::size_t i) {  // of giving the messages of i chunks of the next
    return pools[i].chunks * (pools[i + 1].message_bytes - pools[i].message_bytes);
  };
  const auto merge = [&pools](std::size_t i) {
    pools[i + 1].chunks += pools[i].chunks;
    pools.erase(pools.begin() + static_cast<std::ptrdiff_t>(i));
  };
  for (std::size_t i = 0; i + 1 < pools.size();) {
    // iceoryx takes the smallest chunk that is large enough, and we ask for larger ones than that.
    if (pools[i + 1].message_bytes - pools[i].message_bytes < kOverhead) {
      merge(i);
    } else {
      ++i;
    }
  }
  while (pools.size() > kMostPools) {
    std::size_t cheapest = 0;
    for (std::size_t i = 1; i + 1 < pools.size(); ++i) {
      if (cost(i) < cost(cheapest)) cheapest = i;
    }
    merge(cheapest);
  }
  return pools;
}

std::string segment_path() {
  const group* ours = getgrgid(getegid());
  return fmt::format("/dev/shm/{}", ours != nullptr ? ours->gr_name : std::to_string(getegid()));
}

void remove_files() {
  const std::string segment = segment_path();
  for (const char* file : {kSocket, "/tmp/roudi.lock", kLock, kManagement, segment.c_str()}) {
    unlink(file);
  }
  // Of clients that could not say goodbye: "iceoryx_rt_PID_TIME".
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/tmp", ignored)) {
    int pid = 0;
    if (std::sscanf(entry.path().filename().c_str(), "iceoryx_rt_%d_", &pid) == 1 &&
        kill(pid, 0) != 0 && errno == ESRCH) {
      unlink(entry.path().c_str());
    }
  }
}

}  // namespace

std::size_t shared_queue_depth(std::size_t depth, std::size_t message_bytes) noexcept {
  const std::size_t more =
      std::min(kQueuedSmall, kQueuedBytes / std::max<std::size_t>(message_bytes, 1));
  return std::min(std::max(depth, more), kMostQueued);
}

std::size_t shared_messages_held(std::size_t depth) noexcept {
  return std::min(depth + kInCallbacks, kMostHeld);
}

std::size_t chunks_of_reader(std::size_t depth, std::size_t message_bytes) noexcept {
  // And the one that is being received.
  return shared_queue_depth(depth, message_bytes) + shared_messages_held(depth) + 1;
}

Roudi find_roudi() {
  Roudi roudi;
  const auto unusable = [&](std::string why) {
    roudi.unusable = std::move(why);
    return roudi;
  };
  struct stat socket {};
  roudi.pid = holder_of_lock();
  if (roudi.pid == 0 || stat(kSocket, &socket) != 0) return unusable("RouDi is not running");
  // Of another user it could not answer us, and we would wait for ever.
  if (socket.st_uid != geteuid() || socket.st_gid != getegid()) {
    return unusable(fmt::format("RouDi belongs to user {} and group {}, and we to {} and {}",
                                socket.st_uid, socket.st_gid, geteuid(), getegid()));
  }
  if (!accepts_connections(kSocket) || !fs::exists(kManagement)) {
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
  return roudi;
}

bool RoudiProcess::is_installed() {
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/usr/bin";
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    if (access((folders.substr(begin, end - begin) + "/iox-roudi").c_str(), X_OK) == 0) return true;
    begin = end + 1;
  }
  return false;
}

RoudiProcess::RoudiProcess(std::vector<ChunkPool> pools) {
  if (!is_installed()) {
    throw Error("iox-roudi is not installed", "apt-get install iceoryx");
  }
  if (const pid_t other = holder_of_lock(); other != 0) {
    throw Error(fmt::format("a RouDi runs already, as process {}", other), "use it, or end it");
  }
  if (pools.empty()) pools.push_back({1024, kChunksOfWriter});
  pools = arrange(std::move(pools));
  std::size_t bytes = kManagementBytes;
  std::string configuration = "[general]\nversion = 1\n[[segment]]\n";
  for (const ChunkPool& pool : pools) {
    // iceoryx adds its own header, of 64 bytes at the most, to each.
    bytes += pool.chunks * (chunk_bytes(pool.message_bytes) + 64);
    configuration += fmt::format("[[segment.mempool]]\nsize = {}\ncount = {}\n",
                                 chunk_bytes(pool.message_bytes), pool.chunks);
  }
  remove_files();  // of one that was killed
  std::error_code failed;
  const fs::space_info space = fs::space("/dev/shm", failed);
  if (failed || space.available < bytes) {
    throw Error(fmt::format("shared memory needs {} MiB, and /dev/shm has {} MiB left",
                            (bytes >> 20) + 1, failed ? 0 : space.available >> 20),
                "mount -o remount,size=… /dev/shm, or smaller depths of the large topics");
  }
  folder_ = fs::temp_directory_path() / "takt_roudi_XXXXXX";
  if (mkdtemp(folder_.data()) == nullptr) {
    throw Error("no folder for RouDi's configuration: " + errno_message(errno));
  }
  const std::string file = folder_ + "/roudi.toml", log = folder_ + "/log";
  std::ofstream(file) << configuration;

  pid_ = fork();
  if (pid_ == 0) {
    // In a session of its own, so that Ctrl-C does not reach it before its clients have ended: it
    // would end them.
    setsid();
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    dup2(output, STDOUT_FILENO), dup2(output, STDERR_FILENO);
    execlp("iox-roudi", "iox-roudi", "-m", "off", "-c", file.c_str(), nullptr);
    _exit(127);
  }
  const auto limit = std::chrono::steady_clock::now() + kStartLimit;
  for (;;) {
    const Roudi found = find_roudi();
    if (found.pid == pid_ && found.unusable.empty() &&
        read_file(log).find("ready for clients") != std::string::npos) {
      return;
    }
    const bool has_ended = waitpid(pid_, nullptr, WNOHANG) == pid_;
    if (has_ended || std::chrono::steady_clock::now() > limit) {
      const std::string words = read_file(log);
      if (!has_ended) {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
      }
      fs::remove_all(folder_, failed);
      throw Error(fmt::format("RouDi does not start: {}", words),
                  "is there memory enough, and another RouDi?");
    }
    std::this_thread::sleep_for(5ms);
  }
}

// Not gently: it would first end all its clients, also those that are not ours. Its files go
// first, so that nobody turns to it any more.
RoudiProcess::~RoudiProcess() {
  const pid_t holder = holder_of_lock();
  if (holder == pid_ || holder == 0) remove_files();  // else it has ended, and another has begun
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace takt
