// SPDX-License-Identifier: Apache-2.0
#include "takt/base/regular_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <mutex>
#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/base/pi_mutex.hpp"

namespace takt {
namespace {

[[noreturn]] void refuse(int error) {
  throw Error("the file cannot be read: " + errno_message(error),
              "check its name and its permissions");
}

void check_kind(const struct stat& about) {
  if (S_ISREG(about.st_mode)) return;
  if (S_ISDIR(about.st_mode)) throw Error("this is a directory", "name a file in it");
  throw Error(fmt::format("this is a {}", S_ISFIFO(about.st_mode)   ? "FIFO or a pipe"
                                          : S_ISSOCK(about.st_mode) ? "socket"
                                                                    : "device"),
              "name a regular file");
}

// Limit: files that a process has read, and which its outputs do not overwrite. At it: the oldest
// is forgotten. Seen: no.
constexpr std::size_t kMostInputs = 1024;

/// Identifies a file; a later file that reuses the inode has another birth time.
struct FileId {
  std::uint64_t device = 0, inode = 0;
  std::int64_t born_s = 0, born_ns = 0;
  bool operator==(const FileId&) const = default;
};

/// The id of the descriptor, or of the path if `fd` is AT_FDCWD. Empty files have none, and so
/// neither have files of /proc, whose identity changes.
std::optional<FileId> id_of(int fd, const char* path) noexcept {
  struct statx about {};
  const int flags = fd == AT_FDCWD ? 0 : AT_EMPTY_PATH;
  if (statx(fd, path, flags, STATX_BASIC_STATS | STATX_BTIME, &about) != 0) return {};
  if (about.stx_size == 0) return {};
  return FileId{std::uint64_t{about.stx_dev_major} << 32U | about.stx_dev_minor, about.stx_ino,
                about.stx_btime.tv_sec, about.stx_btime.tv_nsec};
}

/// The files that were read last.
class Inputs {
 public:
  bool has(const FileId& file) noexcept {
    const std::lock_guard lock(mutex_);
    return is_known(file);
  }
  void add(const FileId& file) noexcept {
    const std::lock_guard lock(mutex_);
    if (!is_known(file)) files_[count_++ % kMostInputs] = file;
  }

 private:
  bool is_known(const FileId& file) const noexcept TAKT_REQUIRES(mutex_) {
    const auto end = files_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kMostInputs));
    return std::find(files_.begin(), end, file) != end;
  }
  PiMutex mutex_;
  std::array<FileId, kMostInputs> files_ TAKT_GUARDED_BY(mutex_);
  std::size_t count_ TAKT_GUARDED_BY(mutex_) = 0;
};

Inputs& inputs() noexcept {
  static detail::NeverDestroyed<Inputs> inputs;
  return *inputs;
}

}  // namespace

bool was_read(const std::string& path) noexcept {
  const std::optional<FileId> file = id_of(AT_FDCWD, path.c_str());
  return file && inputs().has(*file);
}

RegularFile::RegularFile(const FilePlace& place) {
  struct stat about {};
  if (!place.is_beneath()) {
    if (stat(place.path().c_str(), &about) != 0) refuse(errno);
    check_kind(about);  // first, as opening a device can have effects
  }
  fd_ = place.open(O_RDONLY | O_NONBLOCK | O_NOCTTY);
  if (fd_ < 0) refuse(errno);
  try {  // the path may name another file by now
    if (fstat(fd_, &about) != 0) refuse(errno);
    check_kind(about);
  } catch (...) {
    close(fd_);
    throw;
  }
  size_ = static_cast<std::uint64_t>(about.st_size);
  if (const auto file = id_of(fd_, "")) inputs().add(*file);
}

RegularFile::~RegularFile() {
  close(fd_);
}

std::size_t RegularFile::read(std::uint64_t offset, std::span<std::byte> to) const {
  std::size_t done = 0;
  while (done < to.size()) {
    const ssize_t now =
        pread(fd_, to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) refuse(errno);
    if (now == 0) break;
    done += static_cast<std::size_t>(now);
  }
  return done;
}

std::string RegularFile::text(std::size_t most) const {
  const auto check_size = [&](std::uint64_t size) {
    if (size <= most) return;
    throw Error(fmt::format("the file is larger than {} MiB", most >> 20U), "name another file");
  };
  check_size(size_);  // before memory is allocated for it
  std::string content;
  // Files of /proc report size 0, and a file may grow.
  for (std::size_t room = size_ + 1;;) {
    const std::size_t begin = content.size();
    content.resize(std::min(begin + room, most + 1));
    content.resize(begin + read(begin, std::as_writable_bytes(std::span(content).subspan(begin))));
    check_size(content.size());
    if (content.size() < begin + room) return content;
    room = std::max<std::size_t>(content.size(), 4096);
  }
}

std::string read_text(const FilePlace& place, std::size_t most) {
  try {
    return RegularFile(place).text(most);
  } catch (const Error& error) {
    throw Error(error.what(), "", place.path());
  }
}

}  // namespace takt
