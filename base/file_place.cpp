// SPDX-License-Identifier: Apache-2.0
#include "takt/base/file_place.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// Closes the descriptor, and keeps errno.
struct Folder {
  explicit Folder(const std::string& path)
      : fd(::open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {}
  ~Folder() {
    const int error = errno;
    if (fd >= 0) close(fd);
    errno = error;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const int fd;
};

struct stat checked(const Folder& folder, const std::string& path) {
  struct stat about {};
  if (folder.fd < 0 || fstat(folder.fd, &about) != 0) {
    throw Error(fmt::format("there is no folder '{}': {}", path, errno_message(errno)),
                "name one that exists");
  }
  if ((about.st_mode & S_IWOTH) != 0) {
    throw Error(fmt::format("every user of this machine can change the folder '{}': its mode is "
                            "{:04o}",
                            path, about.st_mode & 07777),
                fmt::format("chmod o-w {}, or name another folder", path));
  }
  return about;
}

void check_own(const Folder& folder, const std::string& path) {
  const struct stat about = checked(folder, path);
  if (about.st_uid == geteuid()) return;
  throw Error(fmt::format("the folder '{}' belongs to user {}, and this process to user {}", path,
                          about.st_uid, geteuid()),
              "name a folder of the user that runs this process");
}

}  // namespace

int FilePlace::open(int flags, mode_t mode) const {
  if (!is_beneath()) return ::open(path_.c_str(), flags | O_CLOEXEC, mode);
  const Folder folder(folder_);
  check_own(folder, folder_);
  const bool creates = (flags & O_CREAT) != 0;
  open_how how{};
  how.flags = static_cast<std::uint64_t>(flags | O_CLOEXEC | (creates ? O_EXCL : 0));
  how.mode = creates ? S_IRUSR | S_IWUSR : 0;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
  return static_cast<int>(syscall(SYS_openat2, folder.fd, path_.c_str(), &how, sizeof how));
}

void check_folder(const std::string& folder) {
  checked(Folder(folder), folder);
}

void check_own_folder(const std::string& folder) {
  check_own(Folder(folder), folder);
}

}  // namespace takt
