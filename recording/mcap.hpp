// The MCAP container format, as far as a recording needs it (https://mcap.dev/spec).
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

/// What is recorded of one topic.
struct RecordedTopic {
  std::string topic;       // "/scan"
  std::string type;        // "sensor_msgs/msg/LaserScan"
  std::string definition;  // as .msg text ("ros2msg"); empty: not known
};

struct RecordedMessage {
  std::size_t topic = 0;          // which of the reader's topics
  std::uint32_t sequence = 0;     // in its topic, from 1
  std::uint64_t log_time_ns = 0;  // since 1970
  std::uint64_t publish_time_ns = 0;
  std::uint64_t begin = 0, size = 0;  // of its bytes in the file: CDR, with its header
};

/// Writes a chunk for each buffer of the file, and a summary at the end.
/// Thread safety: one thread at a time.
/// Real-time: as RingFile; a chunk's place is remembered, which allocates now and then.
class McapWriter {
 public:
  /// Throws Error as RingFile does.
  McapWriter(const std::string& path, std::size_t buffer_bytes, std::size_t buffers);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// The number to write its messages with.
  std::size_t add(RecordedTopic topic);
  /// False: there was no room, because the disk is slow, full, or the message larger than a buffer.
  bool write(std::size_t topic, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
             std::span<const std::byte> bytes) noexcept;
  /// Whether something waits for `flush`.
  bool is_pending() const noexcept { return used_ != 0; }
  /// Hands over what was written so far.
  void flush() noexcept;
  /// Ends the file; nothing is written afterwards. False: a write had failed.
  bool close() noexcept;
  /// What errno says of the first write that failed; 0: none has.
  int error() const noexcept { return file_.error(); }
  const std::string& why_no_ring() const noexcept { return file_.why_no_ring(); }
  /// That were taken, but for those that are lost.
  std::uint64_t messages() const noexcept;
  /// Taken, and not in the file because a write has failed. Known after `close`.
  std::uint64_t lost() const noexcept { return lost_; }
  std::uint64_t bytes() const noexcept { return file_.offset(); }

 private:
  struct Topic {
    RecordedTopic topic;
    std::uint64_t messages = 0;
    bool is_written = false;  // its schema and channel
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
  std::size_t used_ = 0;  // of the buffer
  std::uint64_t lost_ = 0;
  bool is_closed_ = false;
};

/// Reads recordings: ours, and others' whose chunks are not compressed. It remembers where each
/// message lies, and not the messages.
/// Thread safety: after the constructor, one thread at a time. Real-time: no.
class McapReader {
 public:
  /// Throws Error when it is no MCAP file, or none that takt reads. One that ends in the middle is
  /// read so far.
  explicit McapReader(const std::string& path);

  const std::vector<RecordedTopic>& topics() const noexcept { return topics_; }
  /// In the order of log_time.
  const std::vector<RecordedMessage>& messages() const noexcept { return messages_; }
  /// The message's bytes, until the next call. Throws Error when the file has become shorter since,
  /// or cannot be read.
  std::span<const std::byte> bytes(const RecordedMessage& message);
  /// It has an end, with a summary.
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
