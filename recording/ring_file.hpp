// A file written from a fixed set of buffers, by io_uring where the kernel permits it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_RING_FILE_HPP_
#define TAKT_RECORDING_RING_FILE_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "takt/base/output_file.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The constructor registers the buffers with the kernel. The caller fills one buffer at a time and
/// passes it on; the kernel writes it while the caller fills the next one. While all buffers are
/// being written, there is none to fill. What does not fit into one gets a buffer of its own, for
/// as long as it is being written.
///
/// The first failed write ends the writing; buffers in progress at that time may be incomplete.
///
/// Without io_uring, a separate thread writes the buffers in the same order.
///
/// Thread safety: one thread at a time.
/// Real-time: only finish() waits for the disk. After the constructor only make_own() allocates.
class RingFile {
 public:
  // Limit: bytes of all buffers of a recorder, those of long messages too. At it: larger buffers
  // are refused; full ones drop messages. Seen: the error; the recorder's count and exit status.
  static constexpr std::size_t kMostBytes = 1'000'000'000;  // of all buffers

  /// Throws Error if the file cannot be created, or the buffers are too large.
  RingFile(const FilePlace& place, std::size_t buffer_bytes, std::size_t buffers);
  ~RingFile();
  RingFile(const RingFile&) = delete;
  RingFile& operator=(const RingFile&) = delete;

  std::size_t buffer_bytes() const noexcept { return buffer_bytes_; }
  /// The buffer to fill; empty while all are being written.
  std::span<std::byte> buffer() noexcept;
  /// From now until write(), the buffer to fill is a new one of this size. Returns false if there
  /// is no memory, or too much is being written.
  bool make_own(std::size_t bytes) noexcept;
  /// Starts writing the first `bytes` of the buffer.
  void write(std::size_t bytes) noexcept;
  /// The position of the next buffer in the file.
  std::uint64_t offset() const noexcept { return offset_; }
  /// Waits until everything is written. Returns false if a write failed.
  bool finish() noexcept;
  /// The errno of the first failed write; 0: none.
  int error() const noexcept { return first_error_; }
  /// Why a thread writes instead of io_uring; empty: io_uring writes.
  const std::string& why_no_ring() const noexcept { return why_no_ring_; }
  /// Everything before this position is written; later parts may have gaps.
  std::uint64_t written() const noexcept { return written_; }
  /// After a failure: truncates the file at `end`, so that the caller can write there again.
  void cut(std::uint64_t end) noexcept;
  /// Finishes, and gives the file its name: see OutputFile. Returns false if this or a write
  /// failed. Nothing is written afterwards.
  bool complete() noexcept;

 private:
  class Writes;
  class RingWrites;
  class ThreadWrites;
  // Limit: long messages that are being written at the same time. At it: a further one is dropped.
  // Seen: the recorder's count and exit status.
  static constexpr std::size_t kMostOwn = 4;
  struct Buffer {
    std::span<std::byte> memory = {};
    std::unique_ptr<std::byte[]> own = nullptr;  // of one that is made for a long message
    std::uint64_t begin = 0;
    std::size_t bytes = 0, done = 0;
    bool is_away = false;
  };
  std::unique_ptr<Writes> make_writes();
  void free_own(Buffer& buffer) noexcept;
  void submit(std::size_t buffer) noexcept;
  void reap() noexcept;
  void completed(std::size_t buffer, int result) noexcept;

  const std::size_t buffer_bytes_;
  OutputFile file_;
  std::string why_no_ring_;
  std::byte* memory_ = nullptr;
  std::size_t memory_bytes_ = 0;
  std::size_t own_bytes_ = 0;
  std::vector<Buffer> buffers_;  // the last ones are for long messages
  std::size_t current_ = SIZE_MAX;
  std::size_t away_ = 0;
  std::uint64_t offset_ = 0, written_ = 0;
  int error_ = 0, first_error_ = 0;  // since cut(), and since the constructor
  std::unique_ptr<Writes> writes_;
};

}  // namespace takt

#endif  // TAKT_RECORDING_RING_FILE_HPP_
