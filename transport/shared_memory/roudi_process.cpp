// RouDi must not be the child of a process that may be killed. Its parent is a keeper, a process
// that ends only when the kernel gives it a lock:
//   1. A process that needs RouDi first finds out how much memory to ask for. Then it takes the
//   lock
//      `start`, so that one at a time looks for RouDi, and then a share of the lock `users`, which
//      it keeps. Its children inherit that.
//   2. If RouDi does not run, it forks a keeper, which starts RouDi, reports through a pipe, and
//      releases `start`.
//   3. The keeper waits for the exclusive lock `users`. The kernel gives it when no user is left,
//      however they have ended. The keeper removes the files, kills RouDi, and ends.
//   4. The last user waits for that end: each keeper has a share of the lock `keepers`. A process
//      that begins meanwhile waits in step 1.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/time.hpp"
#include "takt/transport/shared_memory/lock_file.hpp"
#include "takt/transport/shared_memory/roudi.hpp"

namespace takt {

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::size_t kManagementBytes = std::size_t{72} << 20;
// Limit: sizes of messages for which RouDi has a pool. At it: a message takes a chunk of the next
// size. Seen: nothing.
constexpr std::size_t kMostPools = 32;
constexpr auto kStartLimit = 20s;
constexpr const char* kFolder = "takt_roudi_";  // the beginning of its name
constexpr auto kLockLimit = 2s;                 // for locks that are released shortly

constexpr std::size_t chunk_bytes(std::size_t message_bytes) {
  return (message_bytes + kChunkOverhead + 7) / 8 * 8;
}

/// At most as many pools as iceoryx allows, in order of size.
std::vector<ChunkPool> arrange(std::vector<ChunkPool> pools) {
  std::sort(pools.begin(), pools.end(),
            [](const auto& a, const auto& b) { return a.message_bytes < b.message_bytes; });
  // The cost of giving the messages of pool i chunks of the next pool.
  const auto cost = [&pools](std::size_t i) {
    return pools[i].chunks * (pools[i + 1].message_bytes - pools[i].message_bytes);
  };
  const auto merge = [&pools](std::size_t i) {
    pools[i + 1].chunks += pools[i].chunks;
    pools.erase(pools.begin() + static_cast<std::ptrdiff_t>(i));
  };
  for (std::size_t i = 0; i + 1 < pools.size();) {
    // iceoryx takes the smallest chunk that is large enough for the message and kChunkOverhead.
    if (pools[i + 1].message_bytes - pools[i].message_bytes < kChunkOverhead) {
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
  for (const char* file :
       {kRoudiSocket, "/tmp/roudi.lock", kRoudiLock, kRoudiManagement, segment.c_str()}) {
    unlink(file);
  }
  // Removes the sockets of clients that could not unregister, "iceoryx_rt_PID_TIME", and of the
  // keeper's own probe of a RouDi that died before it answered, "iceoryx_rt_PID_takt".
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/tmp", ignored)) {
    int pid = 0;
    if (std::sscanf(entry.path().filename().c_str(), "iceoryx_rt_%d_", &pid) == 1 &&
        (pid == getpid() || (kill(pid, 0) != 0 && errno == ESRCH))) {
      unlink(entry.path().c_str());
    }
  }
}

/// Where keepers have their folders.
fs::path place_of_folders() {
  return fs::temp_directory_path();
}

/// Folders of killed keepers: they belong to an earlier RouDi, as only one runs at a time.
void remove_folders() {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(place_of_folders(), ignored)) {
    struct stat folder {};
    if (entry.path().filename().string().starts_with(kFolder) &&
        lstat(entry.path().c_str(), &folder) == 0 && S_ISDIR(folder.st_mode) &&
        folder.st_uid == geteuid()) {
      fs::remove_all(entry.path(), ignored);
    }
  }
}

std::string contents_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Throws Error when a mount is missing, with which RouDi would end by an assertion.
void check_mounts() {
  if (access("/dev/shm", W_OK) != 0) {
    throw Error("shared memory cannot be used: " + errno_message(errno),
                "mount a tmpfs there that this user can write to", "/dev/shm");
  }
  if (access("/proc/self", F_OK) != 0) {
    throw Error("shared memory cannot be used: nothing is mounted there",
                "mount -t proc proc /proc", "/proc");
  }
}

/// The last line that is not empty.
std::string last_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

/// RouDi, as a child process of the keeper.
class Server {
 public:
  explicit Server(std::vector<ChunkPool> pools);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  void wait_until_it_serves();
  pid_t pid() const noexcept { return pid_; }

 private:
  std::string folder_;  // for the configuration and log of RouDi
  pid_t pid_ = 0;
};

Server::Server(std::vector<ChunkPool> pools) {
  if (pools.empty()) pools.push_back({1024, kChunksOfWriter});
  pools = arrange(std::move(pools));
  std::size_t bytes = kManagementBytes;
  std::string configuration = "[general]\nversion = 1\n[[segment]]\n";
  for (const ChunkPool& pool : pools) {
    // iceoryx adds a header of at most 64 bytes to each chunk.
    bytes += pool.chunks * (chunk_bytes(pool.message_bytes) + 64);
    configuration += fmt::format("[[segment.mempool]]\nsize = {}\ncount = {}\n",
                                 chunk_bytes(pool.message_bytes), pool.chunks);
  }
  check_mounts();
  remove_files(), remove_folders();  // those of a killed RouDi
  std::error_code failed;
  const fs::space_info space = fs::space("/dev/shm", failed);
  if (failed || space.available < bytes) {
    throw Error(fmt::format("shared memory needs {} MiB, and /dev/shm has {} MiB left",
                            (bytes >> 20) + 1, failed ? 0 : space.available >> 20),
                "mount -o remount,size=… /dev/shm, or smaller depths of the large topics");
  }
  std::string folder = place_of_folders() / fmt::format("{}XXXXXX", kFolder);
  if (mkdtemp(folder.data()) == nullptr) {
    throw Error("no folder for RouDi's configuration: " + errno_message(errno));
  }
  folder_ = folder;
  const std::string file = folder_ + "/roudi.toml", log = folder_ + "/log";
  std::ofstream(file) << configuration;
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    dup2(output, STDOUT_FILENO), dup2(output, STDERR_FILENO);
    execlp("iox-roudi", "iox-roudi", "-m", "off", "-c", file.c_str(), nullptr);
    _exit(127);
  }
}

// Kills by SIGKILL: at SIGTERM, RouDi would first end all its clients, also those of other
// programs. Its files are removed first, so that no client connects any more.
Server::~Server() {
  const pid_t holder = holder_of_roudi_lock();
  if (holder == pid_ || holder == 0) remove_files();  // else another RouDi runs
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void Server::wait_until_it_serves() {
  const auto limit = std::chrono::steady_clock::now() + kStartLimit;
  for (;;) {
    const std::string words = contents_of(folder_ + "/log");
    if (words.find("ready for clients") != std::string::npos) {
      const Roudi found = find_roudi();
      if (found.pid == pid_ && found.unusable.empty()) return;
    }
    siginfo_t end{};
    waitid(P_PID, static_cast<id_t>(pid_), &end, WEXITED | WNOHANG | WNOWAIT);
    if (end.si_pid == pid_ || std::chrono::steady_clock::now() > limit) {
      throw Error(fmt::format("RouDi does not start: {}", last_line(words)),
                  "is there memory enough, and another RouDi?");
    }
    std::this_thread::sleep_for(5ms);
  }
}

void write_report(int report, const std::string& text) {
  [[maybe_unused]] const ssize_t ignored = write(report, text.data(), text.size());
  close(report);
}

std::string read_report(int report) {
  std::string text;
  std::array<char, 4096> part{};
  for (ssize_t size; (size = read(report, part.data(), part.size())) != 0;) {
    if (size > 0) text.append(part.data(), static_cast<std::size_t>(size));
    if (size < 0 && errno != EINTR) break;
  }
  close(report);
  return text;
}

}  // namespace

void RoudiProcess::LockFile::keep(int report, const LockFile& start, std::vector<ChunkPool> pools) {
  // A session of its own: Ctrl-C or a closed terminal does not end the keeper.
  setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_IGN);
  prctl(PR_SET_NAME, "takt_roudi");
  // Closes the other inherited descriptors: the parent's share of `users`, and pipes that another
  // process reads to the end.
  constexpr unsigned kFirst = STDERR_FILENO + 1;
  const auto [lower, higher] =
      std::minmax({static_cast<unsigned>(report), static_cast<unsigned>(start.fd_)});
  if (lower > kFirst) close_range(kFirst, lower - 1, 0);
  if (higher > lower + 1) close_range(lower + 1, higher - 1, 0);
  close_range(higher + 1, ~0U, 0);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, fd);
  try {
    const LockFile keepers("keepers"), users("users");
    keepers.lock(LOCK_SH);
    Server server(std::move(pools));
    server.wait_until_it_serves();
    write_report(report, std::to_string(server.pid()));
    close(start.fd_);
    users.lock(LOCK_EX);
  } catch (const std::exception& error) {
    write_report(report, error.what());
  }
  _exit(0);
}

RoudiProcess::RoudiProcess(const std::function<std::vector<ChunkPool>()>& pools)
    : users_(std::make_unique<LockFile>("users", 0)) {
  const auto want = [&pools] {
    if (!is_installed()) throw Error("iox-roudi is not installed", "apt-get install iceoryx");
    return pools();
  };
  std::optional<std::vector<ChunkPool>> wanted;
  if (find_roudi().pid == 0) wanted = want();  // slow, so before taking the lock
  const LockFile start("start"), keepers("keepers");
  start.check_owner();
  users_->check_owner();
  // Another start holds the lock for longer only while its keeper starts RouDi.
  if (!start.lock_within(LOCK_EX, kLockLimit) &&
      (keepers.lock(LOCK_EX | LOCK_NB) || !start.lock_within(LOCK_EX, kStartLimit))) {
    throw Error("another run holds the lock with which one at a time starts RouDi",
                "end that run: lslocks shows who has /tmp/.takt_roudi_*.start");
  }
  if (!users_->lock_within(LOCK_SH, kLockLimit)) {
    throw Error("the RouDi of another run does not end",
                "end it: lslocks shows who has /tmp/.takt_roudi_*.users");
  }
  pid_ = find_roudi().pid;
  if (pid_ != 0) return;         // if it cannot be used, joining reports why
  if (!wanted) wanted = want();  // RouDi has ended since the first look
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw Error("no pipe: " + errno_message(errno));
  keeper_ = fork();
  if (keeper_ == 0) LockFile::keep(ends[1], start, std::move(*wanted));
  close(ends[1]);
  const std::string said = read_report(ends[0]);
  pid_ = std::atoi(said.c_str());
  if (pid_ != 0) return;
  waitpid(keeper_, nullptr, 0);
  throw Error(said.empty() ? "the process that starts RouDi has died" : said);
}

// If a lock does not come free, the keeper ends without us.
RoudiProcess::~RoudiProcess() {
  users_.reset();
  const LockFile start("start"), users("users"), keepers("keepers");
  if (!start.lock_within(LOCK_EX, kLockLimit)) return;
  // Other users hold shares of the lock, unless a keeper holds it exclusively.
  if (!users.lock(LOCK_EX | LOCK_NB) && users.lock(LOCK_SH | LOCK_NB)) return;
  users.lock(LOCK_UN);
  if (keepers.lock_within(LOCK_EX, kLockLimit) && keeper_ > 0) waitpid(keeper_, nullptr, 0);
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

}  // namespace takt
