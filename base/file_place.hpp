// A file that somebody names, and where it may lie.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_FILE_PLACE_HPP_
#define TAKT_BASE_FILE_PLACE_HPP_

#include <string>

#include <sys/types.h>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// What the owner of a process names may lie anywhere; what a request names, only beneath a folder
/// that the owner has named. Otherwise a request could use the owner's rights.
/// Thread safety: none, as for any value. Real-time: no.
class FilePlace {
 public:
  FilePlace(std::string path) : path_(std::move(path)) {}        // NOLINT: anywhere
  FilePlace(const char* path) : FilePlace(std::string(path)) {}  // NOLINT: anywhere
  FilePlace(std::string folder, std::string path)
      : folder_(std::move(folder)), path_(std::move(path)) {}

  /// The same place, only to ask whether a file can be written there: see OutputFile.
  FilePlace as_checked_only() const {
    FilePlace place = *this;
    place.is_checked_only_ = true;
    return place;
  }

  bool is_checked_only() const noexcept { return is_checked_only_; }
  bool is_beneath() const noexcept { return !folder_.empty(); }
  /// For messages, and to open a file that may lie anywhere.
  std::string path() const { return is_beneath() ? folder_ + "/" + path_ : path_; }
  /// As open(2), with O_CLOEXEC. Beneath a folder it follows no link, creates only new files, and
  /// throws Error if others can change the folder, or one on the way to the file.
  int open(int flags, mode_t mode = 0) const;

 private:
  std::string folder_;  // empty: anywhere
  std::string path_;
  bool is_checked_only_ = false;
};

/// Throws Error unless the folder exists, and only its owner or its group can change it.
void check_folder(const std::string& folder);
/// Throws Error unless, besides, the folder belongs to the user of this process.
void check_own_folder(const std::string& folder);
/// Of a folder for which check_folder() holds, and a file beneath it, both without links. Throws
/// Error unless the same holds for each folder on the way and for the file, and all belong to the
/// folder's owner, to the user of this process, or to root.
void check_beneath(const std::string& folder, const std::string& file);
/// Of a file that nobody has named. Throws Error unless it, each folder above it and each link on
/// the way belong to the user of this process or to root, and nobody else can change them. In a
/// folder above it that is sticky and root's, as /tmp is, others can change only what is theirs.
void check_ours(const std::string& file);

}  // namespace takt

#endif  // TAKT_BASE_FILE_PLACE_HPP_
