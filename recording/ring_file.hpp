// A file that is written from a fixed set of buffers, by io_uring where the kernel grants it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_RING_FILE_HPP_
#define TAKT_RECORDING_RING_FILE_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace takt {

/// Buffers are registered with the kernel when the file is opened. One is filled at a time, and
/// handed over whole; the kernel writes it while the next one is filled. When all are on their way
/// there is none to fill, and the caller goes without.
///
/// After the first write that fails nothing more is written; what was on its way by then may lack.
///
/// Where there is no io_uring a thread of the file's own writes, in the same order.
///
/// Thread safety: one thread at a time.
/// Real-time: no call waits for the disk but `finish`; the kernel's workers do, or the thread.
/// Nothing allocates after the constructor.
class RingFile {
 public:
  /// Throws Error when the file cannot be made.
  RingFile(const std::string& path, std::size_t buffer_bytes, std::size_t buffers);
  ~RingFile();
  RingFile(const RingFile&) = delete;
  RingFile& operator=(const RingFile&) = delete;

  std::size_t buffer_bytes() const noexcept { return buffer_bytes_; }
  /// The buffer to be filled; empty when all are on their way.
  std::span<std::byte> buffer() noexcept;
  /// Hands over its first bytes.
  void write(std::size_t bytes) noexcept;
  /// Where the next buffer will be in the file.
  std::uint64_t offset() const noexcept { return offset_; }
  /// Waits until everything is written. False: a write has failed.
  bool finish() noexcept;
  /// What errno says of the first write that failed; 0: none has.
  int error() const noexcept { return first_error_; }
  /// Why a thread writes; empty: io_uring does.
  const std::string& why_no_ring() const noexcept { return why_no_ring_; }
  /// How far all is written. Behind it something may lack.
  std::uint64_t written() const noexcept { return written_; }
  /// After a failure: cuts off what comes after `end`, so that one can try to write again there.
  void cut(std::uint64_t end) noexcept;

 private:
  class Writes;
  class RingWrites;
  class ThreadWrites;
  struct Buffer {
    std::uint64_t begin = 0;
    std::size_t bytes = 0, done = 0;
    bool is_away = false;
  };
  void open_file(const std::string& path);
  std::unique_ptr<Writes> make_writes();
  void submit(std::size_t buffer) noexcept;
  void reap() noexcept;
  void completed(std::size_t buffer, int result) noexcept;

  const std::size_t buffer_bytes_;
  int fd_ = -1;
  std::string why_no_ring_;
  std::byte* memory_ = nullptr;
  std::size_t memory_bytes_ = 0;
  std::vector<Buffer> buffers_;
  std::size_t current_ = SIZE_MAX;
  std::size_t away_ = 0;
  std::uint64_t offset_ = 0, written_ = 0;
  int error_ = 0, first_error_ = 0;  // since `cut`, and ever
  std::unique_ptr<Writes> writes_;
};

}  // namespace takt

#endif  // TAKT_RECORDING_RING_FILE_HPP_
