// SPDX-License-Identifier: Apache-2.0
#include "takt/base/file_place.hpp"

#include <algorithm>
#include <cerrno>
#include <deque>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/openat2.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// Closes the descriptor, and keeps errno.
struct Folder {
  explicit Folder(const std::string& path)
      : Folder(::open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {}
  explicit Folder(int opened) : fd(opened) {}
  ~Folder() {
    const int error = errno;
    if (fd >= 0) close(fd);
    errno = error;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const int fd;
};

/// The users that may change a file or a folder.
struct Rule {
  std::vector<uid_t> owners;    // the allowed owners; empty: any user
  bool may_be_of_group = true;  // whether a shared group may change it
};

/// Whether this is a group of one user only, as Debian makes one for each user.
bool is_private_group(gid_t id, uid_t owner) {
  const passwd* const user = getpwuid(owner);
  const std::string name = user != nullptr ? user->pw_name : "";
  const group* const own = getgrgid(id);
  return own != nullptr && name == own->gr_name &&
         (own->gr_mem[0] == nullptr || (name == own->gr_mem[0] && own->gr_mem[1] == nullptr));
}

/// The only place that decides whether other users can change a file or folder.
void check(const struct stat& about, const std::string& path, const Rule& rule) {
  const std::string it =
      fmt::format("the {} '{}'", S_ISDIR(about.st_mode) ? "folder" : "file", path);
  const unsigned mode = about.st_mode & 07777;
  if ((about.st_mode & S_IWOTH) != 0) {
    throw Error(
        fmt::format("every user of this machine can change {}: its mode is {:04o}", it, mode),
        fmt::format("chmod o-w {}, or name another folder", path));
  }
  // With an ACL, the group's bits are the upper limit for all users and groups that the ACL names.
  const bool has_list = getxattr(path.c_str(), "system.posix_acl_access", nullptr, 0) > 0;
  if (!rule.may_be_of_group && (about.st_mode & S_IWGRP) != 0 &&
      (has_list || !is_private_group(about.st_gid, about.st_uid))) {
    throw Error(fmt::format("group {} can change {}: its mode is {:04o}", about.st_gid, it, mode),
                fmt::format("chmod g-w {}, or name another folder", path));
  }
  const auto& owners = rule.owners;
  if (owners.empty() || std::find(owners.begin(), owners.end(), about.st_uid) != owners.end()) {
    return;
  }
  throw Error(fmt::format("{} belongs to user {}, and this process to user {}", it, about.st_uid,
                          geteuid()),
              fmt::format("name a {} of the user that runs this process",
                          S_ISDIR(about.st_mode) ? "folder" : "file"));
}

struct stat checked(const Folder& folder, const std::string& path, const Rule& rule) {
  struct stat about {};
  if (folder.fd < 0 || fstat(folder.fd, &about) != 0) {
    throw Error(fmt::format("there is no folder '{}': {}", path, errno_message(errno)),
                "name one that exists");
  }
  check(about, path, rule);
  return about;
}

struct stat about_link(const std::filesystem::path& path) {
  struct stat about {};
  if (lstat(path.c_str(), &about) == 0) return about;
  throw Error(fmt::format("there is no file '{}': {}", path.string(), errno_message(errno)),
              "name one that exists");
}

Rule own() {
  return {.owners = {geteuid()}};
}

int open_beneath(const Folder& folder, const std::string& path, int flags, mode_t mode) {
  open_how how{};
  how.flags = static_cast<std::uint64_t>(flags | O_CLOEXEC);
  how.mode = mode;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
  return static_cast<int>(syscall(SYS_openat2, folder.fd, path.c_str(), &how, sizeof how));
}

}  // namespace

int FilePlace::open(int flags, mode_t mode) const {
  if (!is_beneath()) return ::open(path_.c_str(), flags | O_CLOEXEC, mode);
  const Folder folder(folder_);
  checked(folder, folder_, own());
  for (std::size_t end = path_.find('/', 1); end != path_.npos; end = path_.find('/', end + 1)) {
    const std::string part = path_.substr(0, end);
    const Folder above(open_beneath(folder, part, O_PATH | O_DIRECTORY, 0));
    if (above.fd < 0) return -1;
    checked(above, folder_ + "/" + part, own());
  }
  const bool creates = (flags & O_CREAT) != 0;
  return open_beneath(folder, path_, flags | (creates ? O_EXCL : 0),
                      creates ? S_IRUSR | S_IWUSR : 0);
}

void check_folder(const std::string& folder) {
  checked(Folder(folder), folder, {});
}

void check_own_folder(const std::string& folder) {
  checked(Folder(folder), folder, own());
}

void check_beneath(const std::string& folder, const std::string& file) {
  const Rule rule{.owners = {about_link(folder).st_uid, geteuid(), 0}};
  std::filesystem::path path = folder;
  for (const auto& part : std::filesystem::path(file).lexically_relative(folder)) {
    path /= part;
    check(about_link(path), path, rule);
  }
}

// Checks each part of the path as the kernel resolves it: the target of a link replaces the link.
void check_ours(const std::string& file) {
  const Rule rule{.owners = {geteuid(), 0}, .may_be_of_group = false};
  constexpr int kLinks = 40;  // as many as the kernel follows
  int links = 0;
  std::filesystem::path path = "/";
  const std::filesystem::path whole = std::filesystem::absolute(file);
  std::deque<std::filesystem::path> rest(whole.begin(), whole.end());
  while (!rest.empty()) {
    const std::filesystem::path part = rest.front();
    rest.pop_front();
    if (part == "." || part.empty()) continue;
    path = part == ".." ? path.parent_path() : path / part;
    struct stat about = about_link(path);
    if (S_ISLNK(about.st_mode)) {
      about.st_mode &= ~static_cast<mode_t>(S_IWGRP | S_IWOTH);  // a link's mode has no meaning
      check(about, path, rule);
      if (++links > kLinks) throw Error(fmt::format("'{}' leads through too many links", file));
      const std::filesystem::path target = std::filesystem::read_symlink(path);
      rest.insert(rest.begin(), target.begin(), target.end());
      path = path.parent_path();
      continue;
    }
    const bool is_sticky =
        S_ISDIR(about.st_mode) && (about.st_mode & S_ISVTX) != 0 && about.st_uid == 0;
    if (!is_sticky || rest.empty()) check(about, path, rule);
  }
}

}  // namespace takt
