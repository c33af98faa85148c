// SPDX-License-Identifier: Apache-2.0
#include "takt/base/regular_file.hpp"

#include <algorithm>
#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"

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

}  // namespace

RegularFile::RegularFile(const FilePlace& place) {
  struct stat about {};
  if (!place.is_beneath()) {
    if (stat(place.path().c_str(), &about) != 0) refuse(errno);
    check_kind(about);  // to open a device can have effects
  }
  fd_ = place.open(O_RDONLY | O_NONBLOCK | O_NOCTTY);
  if (fd_ < 0) refuse(errno);
  try {  // it may be another one by now
    if (fstat(fd_, &about) != 0) refuse(errno);
    check_kind(about);
  } catch (...) {
    close(fd_);
    throw;
  }
  size_ = static_cast<std::uint64_t>(about.st_size);
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
  check_size(size_);  // before there is room for it
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
