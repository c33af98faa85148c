// The writer of all files that Takt leaves to people.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_OUTPUT_FILE_HPP_
#define TAKT_BASE_OUTPUT_FILE_HPP_

#include <string>
#include <string_view>

#include "takt/base/file_place.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// What files of Takt begin with, each in a comment of its format; of JSON, spaces, which no reader
/// minds. A file that begins so is Takt's, and may be overwritten.
inline constexpr std::string_view kTaktsText = "Written by takt";
inline constexpr std::string_view kTaktsJson = "\t \t ";

/// Overwrites what Takt wrote, an empty file, a device or a pipe, and no other: no file of a
/// person unless permit_overwriting() was called, and none that this process has read (see
/// was_read()). What is there stays until the new content is complete: that is in a file beside it,
/// NAME.incomplete-XXXXXX, which then gets the name. At a place that is checked
/// only, it throws as it would, and what is written goes nowhere. `tools/check` refuses other ways
/// to write.
/// Thread safety: one thread at a time; the static functions: any thread.
/// Real-time: no.
class OutputFile {
 public:
  /// `person`: someone goes on with it in an editor. It is new, and has no mark. `unmarked`: its
  /// format has no place for a mark, so that the next one is not recognised, either.
  enum class Whose { takt, person, unmarked };

  /// Throws Error, which names the path, if the constructor would. Changes nothing.
  static void check(const FilePlace& place);
  /// The owner of the process permits to overwrite files of people.
  static void permit_overwriting() noexcept;
  static bool may_overwrite() noexcept;

  /// Throws Error, which names the path, if what is there must stay, or nothing can be written.
  explicit OutputFile(const FilePlace& place, Whose whose = Whose::takt);
  /// Unless it is complete, the old content stays; without one, nothing does.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// For writes at positions.
  int fd() const noexcept { return fd_; }
  /// Appends. The first text begins with one of the marks. Throws std::runtime_error, which names
  /// the path.
  void write(std::string_view text);
  /// The new content takes the place of the old one. Throws std::runtime_error as write() does.
  void complete();
  /// The same; returns 0, or the errno.
  int try_complete() noexcept;

 private:
  std::string path_;
  std::string beside_;  // where the content is until it is complete; empty: under its name
  std::string target_;  // what `path_` leads to
  int fd_ = -1;
  bool is_new_ = false;  // and goes if it does not become complete
  bool has_mark_ = false;
};

/// Writes a whole file, as OutputFile does.
void write_output(const FilePlace& place, std::string_view text);

}  // namespace takt

#endif  // TAKT_BASE_OUTPUT_FILE_HPP_
