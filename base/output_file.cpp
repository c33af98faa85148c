// SPDX-License-Identifier: Apache-2.0
#include "takt/base/output_file.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"

namespace takt {
namespace {

constexpr std::size_t kHead = 512;  // the mark of Takt's files is in these bytes
constexpr std::string_view kMcap = "\x89MCAP0\r\n";
std::atomic<bool> is_permitted{false};

[[noreturn]] void refuse(const std::string& path, const std::string& why, const std::string& what) {
  throw Error(why, what, path);
}

[[noreturn]] void refuse(const std::string& path, int error) {
  refuse(path, "the file cannot be written: " + errno_message(error), "choose a writable file");
}

std::runtime_error not_written(const std::string& path, int error) {
  return std::runtime_error(Error("the file could not be written: " + errno_message(error),
                                  "choose a writable file on a disk with free space", path)
                                .what());
}

bool begins_as_takts(std::string_view head) {
  const auto comment = [&](std::string_view begin) {
    return head.starts_with(begin) && head.substr(begin.size()).starts_with(kTaktsText);
  };
  if (comment("# ") || comment("// ")) return true;
  if (head.starts_with("file,executor,")) {  // CSV, to which later versions add columns
    return head.find(",scheduler,composition,repeat,") != head.npos;
  }
  if (head.starts_with("<")) {  // in HTML and SVG other things come first
    return head.find(fmt::format("<!-- {}", kTaktsText)) != head.npos;
  }
  if (head.starts_with(kMcap)) return head.find("takt ") != head.npos;  // the library that wrote it
  if (!head.starts_with(kTaktsJson)) return false;
  const std::string_view document = head.substr(kTaktsJson.size());
  return document.starts_with('{') || document.starts_with('[');
}

/// Whether a JSON object has the key "takt": results of earlier versions have it.
class KeySearch {
 public:
  bool found() const noexcept { return found_; }
  void read(std::string_view block) noexcept {
    for (const char one : block) read(one);
  }

 private:
  void read(char one) noexcept {
    constexpr std::string_view kKey = "takt";
    if (is_text_) {
      if (escapes_) {
        escapes_ = false;
      } else if (one == '\\') {
        escapes_ = true;
        length_ = kKey.size() + 1;  // not "takt"
      } else if (one == '"') {
        is_text_ = false;
        is_key_ = depth_ == 1 && length_ == kKey.size();
      } else {
        length_ = length_ < kKey.size() && one == kKey[length_] ? length_ + 1 : kKey.size() + 1;
      }
      return;
    }
    if (one == '"') {
      is_text_ = true;
      length_ = 0;
    } else if (one == '{' || one == '[') {
      ++depth_;
    } else if (one == '}' || one == ']') {
      --depth_;
    }
    if (one == ':' && is_key_) found_ = true;
    if (one != ' ') is_key_ = false;
  }
  int depth_ = 0;
  std::size_t length_ = 0;  // letters of "takt" read so far
  bool is_text_ = false, escapes_ = false, is_key_ = false, found_ = false;
};

bool is_takts(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return false;
  std::array<char, 65536> block;
  KeySearch search;
  bool is_ours = false, is_first = true;
  for (ssize_t size = 0; !is_ours && (size = ::read(fd, block.data(), block.size())) > 0;) {
    const std::string_view text(block.data(), static_cast<std::size_t>(size));
    if (is_first && begins_as_takts(text.substr(0, kHead))) is_ours = true;
    if (is_first && !text.starts_with('{')) break;
    is_first = false;
    search.read(text);
    is_ours = is_ours || search.found();
  }
  close(fd);
  return is_ours;
}

/// The file of that name, and whether it is replaced.
struct Target {
  bool exists = false;
  bool is_replaced = false;  // it is a regular file with a content
  struct stat about {};
};

/// /dev/stdout may be a file that other processes write to as well: it is never replaced.
bool is_descriptor(const std::string& path) {
  return path.starts_with("/dev/") || path.starts_with("/proc/");
}

Target look_at(const std::string& path) {
  Target target;
  target.exists = stat(path.c_str(), &target.about) == 0;
  if (!target.exists) {
    if (errno != ENOENT) refuse(path, errno);
    return target;
  }
  if (S_ISDIR(target.about.st_mode)) refuse(path, "this is a directory", "name a file in it");
  if (!S_ISREG(target.about.st_mode) || is_descriptor(path)) return target;
  if (was_read(path)) {
    refuse(path, "this file is an input of the same command, and is not overwritten",
           "name another file");
  }
  if (target.about.st_size != 0 && !is_permitted.load() && !is_takts(path)) {
    refuse(path, "this file exists, and takt did not write it: it is not overwritten",
           "name another file, move this one away, or give --force to the command");
  }
  if (access(path.c_str(), W_OK) != 0) refuse(path, errno);
  target.is_replaced = target.about.st_size != 0;
  return target;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

void check_folder_of(const std::string& path) {
  if (access(folder_of(path).c_str(), W_OK | X_OK) != 0) refuse(path, errno);
}

}  // namespace

void OutputFile::check(const FilePlace& place) {
  if (place.is_beneath()) return;  // only new files can be made there
  const std::string path = place.path();
  const Target target = look_at(path);
  std::error_code none;
  if (!target.exists && std::filesystem::is_symlink(path, none)) return;  // its target is made
  if (!target.exists) check_folder_of(path);
  if (target.is_replaced) check_folder_of(std::filesystem::canonical(path).string());
}

void OutputFile::permit_overwriting() noexcept {
  is_permitted.store(true);
}

bool OutputFile::may_overwrite() noexcept {
  return is_permitted.load();
}

OutputFile::OutputFile(const FilePlace& place, Whose whose)
    : path_(place.path()), has_mark_(whose != Whose::takt) {
  if (place.is_checked_only()) {
    check(place);
    fd_ = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  } else if (place.is_beneath() || whose == Whose::person) {
    fd_ = place.open(O_CREAT | O_EXCL | O_WRONLY, 0666);
    is_new_ = true;
  } else if (const Target target = look_at(path_); !target.is_replaced) {
    const bool is_file = !target.exists || S_ISREG(target.about.st_mode);
    // Not O_TRUNC: the file is empty, or another process has just begun to write to it.
    fd_ = place.open(O_CREAT | O_WRONLY | (is_file ? 0 : O_APPEND), 0666);
    is_new_ = !target.exists;
    if (is_descriptor(path_) && fd_ >= 0) lseek(fd_, 0, SEEK_END);
  } else {
    target_ = std::filesystem::canonical(path_).string();
    beside_ = target_ + ".incomplete-XXXXXX";
    fd_ = mkostemp(beside_.data(), O_CLOEXEC);
    if (fd_ >= 0) {
      // Keeps owner and mode, if the system permits: other users can still read the file.
      if (fchown(fd_, target.about.st_uid, target.about.st_gid) != 0) errno = 0;
      fchmod(fd_, target.about.st_mode & 07777);
    }
  }
  if (fd_ < 0) refuse(path_, errno);
}

OutputFile::~OutputFile() {
  if (fd_ < 0) return;
  close(fd_);
  if (!beside_.empty()) unlink(beside_.c_str());
  if (is_new_) unlink(path_.c_str());
}

void OutputFile::write(std::string_view text) {
  if (!has_mark_ && !begins_as_takts(text.substr(0, kHead))) {
    throw std::logic_error(path_ + ": an output of takt begins with no mark of takt");
  }
  has_mark_ = true;
  while (!text.empty()) {
    const ssize_t size = ::write(fd_, text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw not_written(path_, errno);
    text.remove_prefix(static_cast<std::size_t>(size));
  }
}

void OutputFile::complete() {
  if (const int error = try_complete(); error != 0) throw not_written(path_, error);
}

int OutputFile::try_complete() noexcept {
  if (fd_ < 0) return 0;
  int error = 0;
  if (close(fd_) != 0) error = errno;
  fd_ = -1;
  if (error == 0 && !beside_.empty() && rename(beside_.c_str(), target_.c_str()) != 0) {
    error = errno;
  }
  return error;
}

void write_output(const FilePlace& place, std::string_view text) {
  OutputFile file(place);
  file.write(text);
  file.complete();
}

}  // namespace takt
