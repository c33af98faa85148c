// Temporary files whose names nobody can foresee.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TEMPORARY_HPP_
#define TAKT_BASE_TEMPORARY_HPP_

#include <string>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// A folder in $TMPDIR, or /tmp, that only this user can enter; the destructor removes it with its
/// files. Under a name that can be foreseen, another user could have placed a file or a link.
/// Thread safety: none. Real-time: no.
class TemporaryFolder {
 public:
  /// Throws Error if the folder cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// The path of a file in it.
  std::string operator/(const std::string& file) const { return path_ + "/" + file; }

 private:
  std::string path_;
};

/// Opens a file without a name in $TMPDIR, or /tmp, for reading and writing; it goes with its
/// descriptor. Returns -1, and errno, if it cannot be made.
int temporary_file();

}  // namespace takt

#endif  // TAKT_BASE_TEMPORARY_HPP_
