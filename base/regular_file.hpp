// A file that is read by position.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_REGULAR_FILE_HPP_
#define TAKT_BASE_REGULAR_FILE_HPP_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace takt {

/// Opens regular files only: to open or read a FIFO or a device can take for ever.
/// Thread safety: all functions are const, and may be called from any thread.
/// Real-time: no.
class RegularFile {
 public:
  /// Throws Error, which does not name the path, when there is none that can be read.
  explicit RegularFile(const std::string& path);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  /// In bytes, when it was opened. Files of /proc say 0.
  std::uint64_t size() const noexcept { return size_; }
  /// Fills `to` with what begins at `offset`. Returns the number of bytes: fewer than `to` has only
  /// at the end of the file. Throws Error when the file cannot be read.
  std::size_t read(std::uint64_t offset, std::span<std::byte> to) const;

 private:
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace takt

#endif  // TAKT_BASE_REGULAR_FILE_HPP_
