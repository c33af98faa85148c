// Writes and reads recordings in the MCAP format (https://mcap.dev/spec).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_MCAP_HPP_
#define TAKT_RECORDING_MCAP_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/regular_file.hpp"
#include "takt/recording/ring_file.hpp"

namespace takt {

/// A recorded topic.
struct RecordedTopic {
  std::string topic;       // "/scan"
  std::string type;        // "sensor_msgs/msg/LaserScan"
  std::string definition;  // .msg text ("ros2msg"); empty: unknown
};

struct RecordedMessage {
  std::size_t topic = 0;          // index in the reader's topics()
  std::uint32_t sequence = 0;     // in its topic, from 1
  std::uint64_t log_time_ns = 0;  // since 1970
  std::uint64_t publish_time_ns = 0;
  std::uint64_t begin = 0, size = 0;  // position of its bytes in the file: CDR, with header
};

/// Writes a recording: one chunk per buffer of the file, and a summary at the end.
/// Thread safety: one thread at a time.
/// Real-time: as RingFile, but a new chunk may allocate, because its position is stored.
class McapWriter {
 public:
  /// Throws Error as RingFile does.
  McapWriter(const std::string& path, std::size_t buffer_bytes, std::size_t buffers);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a topic, and returns its number for write().
  std::size_t add(RecordedTopic topic);
  /// Returns false if there was no space: the disk is slow or full, or the message exceeds a
  /// buffer.
  bool write(std::size_t topic, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
             std::span<const std::byte> bytes) noexcept;
  /// Whether the present buffer contains data.
  bool is_pending() const noexcept { return used_ != 0; }
  /// Starts writing the present buffer, even if it is not full.
  void flush() noexcept;
  /// Completes the file. Returns false if a write failed.
  bool close() noexcept;
  /// The errno of the first failed write; 0: none.
  int error() const noexcept { return file_.error(); }
  const std::string& why_no_ring() const noexcept { return file_.why_no_ring(); }
  /// Number of accepted messages without lost ones.
  std::uint64_t messages() const noexcept;
  /// Number of accepted messages that a failed write lost. Valid after close().
  std::uint64_t lost() const noexcept { return lost_; }
  std::uint64_t bytes() const noexcept { return file_.offset(); }

 private:
  struct Topic {
    RecordedTopic topic;
    std::uint64_t messages = 0;
    bool is_written = false;  // whether schema and channel are in the file
  };
  struct Chunk {
    std::uint64_t begin = 0, end = 0;  // in the file
    std::uint64_t first_ns = 0, last_ns = 0;
    std::uint64_t messages = 0;
  };
  bool begin_chunk() noexcept;
  std::string summary() const;

  RingFile file_;
  std::vector<Topic> topics_;
  std::vector<Chunk> chunks_;
  Chunk current_;
  std::size_t used_ = 0;  // bytes in the present buffer
  std::uint64_t lost_ = 0;
  bool is_closed_ = false;
};

/// Reads uncompressed recordings of Takt and other programs. It keeps the positions of messages in
/// memory, not the messages.
/// Thread safety: after the constructor, one thread at a time. Real-time: no.
class McapReader {
 public:
  /// Throws Error if the file is no MCAP file, or uses features that Takt does not support. Reads a
  /// truncated file up to its end.
  explicit McapReader(const std::string& path);

  const std::vector<RecordedTopic>& topics() const noexcept { return topics_; }
  /// Sorted by log_time_ns.
  const std::vector<RecordedMessage>& messages() const noexcept { return messages_; }
  /// The message's bytes, valid until the next call. Throws Error if the file was truncated since,
  /// or cannot be read.
  std::span<const std::byte> bytes(const RecordedMessage& message);
  /// Whether the file was completed: it has a summary and an end.
  bool is_complete() const noexcept { return is_complete_; }

 private:
  class Cursor;
  void read(Cursor& records, std::uint64_t end, bool is_in_chunk);
  void read_record(std::uint8_t opcode, Cursor& content, bool is_in_chunk);

  const std::string path_;
  const RegularFile file_;
  std::vector<std::byte> bytes_;                                          // of the last message
  std::map<std::uint16_t, std::pair<std::string, std::string>> schemas_;  // name, text
  std::map<std::uint16_t, std::size_t> channels_;
  std::vector<RecordedTopic> topics_;
  std::vector<RecordedMessage> messages_;
  bool is_complete_ = false;
};

}  // namespace takt

#endif  // TAKT_RECORDING_MCAP_HPP_
