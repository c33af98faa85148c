// Writes and reads recordings in the MCAP format (https://mcap.dev/spec).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_MCAP_HPP_
#define TAKT_RECORDING_MCAP_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/regular_file.hpp"
#include "takt/base/visibility.hpp"
#include "takt/recording/compression.hpp"
#include "takt/recording/ring_file.hpp"

namespace TAKT_INTERNAL takt {

/// A recorded topic.
struct RecordedTopic {
  std::string topic;       // "/scan"
  std::string type;        // "sensor_msgs/msg/LaserScan"
  std::string definition;  // .msg text ("ros2msg"); empty: unknown
  std::string qos;         // the publishers', as in ROS 2's recordings; empty: unknown
};

struct RecordedMessage {
  std::size_t topic = 0;          // index in the reader's topics()
  std::uint32_t sequence = 0;     // in its topic, from 1
  std::uint64_t log_time_ns = 0;  // since 1970
  std::uint64_t publish_time_ns = 0;
  std::uint64_t begin = 0, size = 0;  // position of its bytes in the file, or in the chunk
  std::uint64_t chunk = 0;  // position in the file of the compressed chunk that contains them
};

/// Writes a recording: one chunk per buffer of the file, with an index of its messages, a checksum,
/// and perhaps compressed; and a summary at the end.
/// Thread safety: one thread at a time.
/// Real-time: as RingFile, but positions of messages and chunks are stored, which may allocate, and
/// a full chunk is compressed; a message that exceeds a buffer allocates one.
class McapWriter {
 public:
  /// Throws Error as RingFile and Compressor do.
  McapWriter(const FilePlace& place, std::size_t buffer_bytes, std::size_t buffers,
             const std::string& compression = "none");
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a topic, and returns its number for write().
  std::size_t add(RecordedTopic topic);
  /// Before the first message of the topic.
  void define(std::size_t topic, std::string definition);
  /// Returns false if there was no space: the disk is slow or full, or the message exceeds what all
  /// buffers may have. One that exceeds a buffer gets its own.
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
    // Of the messages in the present chunk: the time, and the place in the chunk.
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;
  };
  struct Chunk {
    std::uint64_t begin = 0, index = 0, end = 0;  // in the file: the chunk, its index, the end
    std::uint64_t compressed = 0, uncompressed = 0;
    std::string compression;
    std::map<std::uint16_t, std::uint64_t> indexes;  // the place of each topic's
    std::uint64_t first_ns = 0, last_ns = 0;
    std::uint64_t messages = 0;
  };
  bool begin_chunk() noexcept;
  std::byte* end_chunk() noexcept;
  std::byte* write_indexes(std::byte* to) noexcept;
  void pass_on(std::size_t bytes) noexcept;
  static std::string chunk_index(const Chunk& chunk);
  std::string summary() const;

  RingFile file_;
  Compressor compressor_;
  std::vector<Topic> topics_;
  std::vector<Chunk> chunks_;
  Chunk current_;
  std::size_t used_ = 0;         // bytes in the present buffer
  std::size_t index_bytes_ = 0;  // that follow
  std::uint32_t crc_ = 0;        // of all buffers
  std::uint64_t lost_ = 0;
  bool is_closed_ = false;
};

/// Reads recordings of Takt and other programs, and checks their checksums. It keeps the positions
/// of messages in memory, not the messages; of compressed recordings, a chunk.
/// Thread safety: after the constructor, one thread at a time. Real-time: no.
class McapReader {
 public:
  /// Throws Error if the file is no MCAP file, is damaged, or uses features that Takt does not
  /// support. Reads a truncated file up to its end.
  explicit McapReader(const FilePlace& place);

  const std::vector<RecordedTopic>& topics() const noexcept { return topics_; }
  /// Sorted by log_time_ns.
  const std::vector<RecordedMessage>& messages() const noexcept { return messages_; }
  /// The message's bytes, valid until the next call. Throws Error if the file was truncated since,
  /// or cannot be read.
  std::span<const std::byte> bytes(const RecordedMessage& message);
  /// The names of the compressions of chunks, "" for none.
  const std::set<std::string>& compressions() const noexcept { return compressions_; }
  std::uint64_t size() const noexcept { return file_.size(); }
  /// Whether the file was completed: it has a summary and an end.
  bool is_complete() const noexcept { return is_complete_; }

 private:
  class Cursor;
  /// Where records lie: in the file itself, or in a chunk.
  struct Place {
    bool is_in_chunk = false;
    std::uint64_t compressed_chunk = 0;
  };
  /// Behind the head of a chunk.
  struct Content {
    std::string compression;
    std::uint64_t begin = 0, size = 0, uncompressed = 0;
    std::uint32_t crc = 0;
  };
  void read(Cursor& records, std::uint64_t end, const Place& place);
  void read_record(std::uint8_t opcode, Cursor& content, const Place& place);
  void read_channel(Cursor& content);
  void read_chunk(Cursor& content);
  void check_uncompressed(const Content& content) const;
  std::vector<std::byte> decompressed(const Content& content) const;
  [[noreturn]] void damaged(const Content& content) const;

  const std::string path_;
  const RegularFile file_;
  std::vector<std::byte> bytes_;             // of the last message, or of the last chunk
  std::uint64_t chunk_ = 0;                  // whose bytes these are
  std::map<std::uint64_t, Content> chunks_;  // that are compressed
  std::set<std::string> compressions_;
  std::map<std::uint16_t, std::pair<std::string, std::string>> schemas_;  // name, text
  std::map<std::uint16_t, std::size_t> channels_;
  std::vector<RecordedTopic> topics_;
  std::vector<RecordedMessage> messages_;
  bool is_complete_ = false;
};

}  // namespace takt

#endif  // TAKT_RECORDING_MCAP_HPP_
