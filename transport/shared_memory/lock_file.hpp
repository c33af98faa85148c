// The locks with which processes agree on who starts RouDi, and until when it lives.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_LOCK_FILE_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_LOCK_FILE_HPP_

#include <cerrno>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/time.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

namespace takt {

/// A lock that the kernel releases when the last process that has the file open has ended.
class RoudiProcess::LockFile {
 public:
  /// `at_exec`: 0 lets a program that this process becomes keep the lock.
  explicit LockFile(const char* name, int at_exec = O_CLOEXEC)
      : path_(fmt::format("/tmp/.takt_roudi_{}.{}", geteuid(), name)),
        fd_(open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | at_exec, 0600)) {}
  ~LockFile() { close(fd_); }
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

  /// `how`: LOCK_SH or LOCK_EX. With LOCK_NB, returns false if the lock is not free.
  bool lock(int how) const {
    int result;
    do {
      result = flock(fd_, how);
    } while (result != 0 && errno == EINTR);
    return result == 0;
  }

  /// Returns false if the lock does not come free in time.
  bool lock_within(int how, Nanoseconds limit) const {
    const TimePoint end = later(std::chrono::steady_clock::now(), limit);
    while (!lock(how | LOCK_NB)) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }

  /// Throws Error if another user can hold the lock: the folder is everybody's, and the name can be
  /// foreseen.
  void check_owner() const {
    struct stat file {};
    if (fd_ >= 0 && fstat(fd_, &file) == 0 && file.st_uid == geteuid()) return;
    throw Error(fmt::format("{} is not ours: {}", path_,
                            fd_ < 0 ? errno_message(errno)
                                    : fmt::format("it belongs to user {}", file.st_uid)),
                "remove it; RouDi cannot be started while it is there");
  }

  /// The main function of the keeper. It keeps `report` and, until RouDi serves, the lock `start`,
  /// because the process that started it may be killed.
  [[noreturn]] static void keep(int report, const LockFile& start, std::vector<ChunkPool> pools);

 private:
  const std::string path_;
  const int fd_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_LOCK_FILE_HPP_
