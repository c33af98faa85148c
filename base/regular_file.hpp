// The reader of all files that a user or another process names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_REGULAR_FILE_HPP_
#define TAKT_BASE_REGULAR_FILE_HPP_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "takt/base/file_place.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Opens only regular files: opening or reading a FIFO or a device can block forever.
/// `tools/check` refuses other ways to read a file.
/// Thread safety: all functions are const, and may be called from any thread.
/// Real-time: no.
class RegularFile {
 public:
  /// Throws Error, which does not contain the path, if there is no readable regular file.
  explicit RegularFile(const FilePlace& place);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  /// Size in bytes when it was opened; 0 for files of /proc.
  std::uint64_t size() const noexcept { return size_; }
  /// Reads from `offset` into `to`. Returns the number of bytes, which is smaller than that of `to`
  /// only at the end of the file. Throws Error if the file cannot be read.
  std::size_t read(std::uint64_t offset, std::span<std::byte> to) const;
  /// The whole content. Throws Error if it is more than `most` bytes.
  std::string text(std::size_t most) const;

 private:
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

/// Whether it is the same file as one that a RegularFile has opened in this process: an output does
/// not overwrite it.
bool was_read(const std::string& path) noexcept;

/// The content of a file, of at most `most` bytes. Throws Error, which names the path.
std::string read_text(const FilePlace& place, std::size_t most);

}  // namespace takt

#endif  // TAKT_BASE_REGULAR_FILE_HPP_
