// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/recording/mcap.hpp"
#include "takt/recording/mcap_format.hpp"

namespace takt {
namespace {

using namespace mcap;

// Size of one read for messages that are close together.
constexpr std::size_t kWindowBytes = 256 << 10;
// What a compressed chunk may have at most: files are untrusted.
// Limit: bytes of a chunk of a recording, decompressed. At it: the file is refused. Seen: the
// error.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30;

RegularFile opened(const FilePlace& place) {
  try {
    return RegularFile(place);
  } catch (const Error& error) {
    throw Error(error.what(), "", place.path());
  }
}

std::size_t read_from(const RegularFile& file, const std::string& path, std::uint64_t offset,
                      std::span<std::byte> to) {
  try {
    return file.read(offset, to);
  } catch (const Error& error) {
    throw Error(error.what(), "", path);
  }
}

Error shorter(const std::string& path) {
  return Error("the recording was truncated during reading",
               "do not change the file while it is played", path);
}

}  // namespace

/// Reads sequentially up to an end; values behind it are 0. It does not use mmap: if the file is
/// truncated meanwhile, an access would kill the process by SIGBUS.
class McapReader::Cursor {
 public:
  Cursor(const RegularFile& file, const std::string& path) : file_(file), path_(path) {}
  /// Over bytes that are there already.
  Cursor(const RegularFile& file, const std::string& path, std::vector<std::byte> bytes)
      : file_(file), path_(path), window_(std::move(bytes)) {}

  std::uint64_t position() const noexcept { return position_; }
  std::uint64_t rest() const noexcept { return end_ - position_; }
  void go_to(std::uint64_t position) noexcept { position_ = position; }
  void set_end(std::uint64_t end) noexcept { end_ = end; }

  template <class T>
  T take() {
    T value{};
    const std::span<const std::byte> from = take(sizeof(T));
    if (!from.empty()) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto from = take(take<std::uint32_t>());
    return {reinterpret_cast<const char*>(from.data()), from.size()};
  }

 private:
  // Returns an empty span if fewer bytes are left. Valid until the next call.
  std::span<const std::byte> take(std::size_t size) {
    if (size > rest()) {
      position_ = end_;
      return {};
    }
    const std::uint64_t begin = std::exchange(position_, position_ + size);
    if (begin < window_begin_ || position_ > window_begin_ + window_.size()) {
      window_begin_ = begin;
      window_.resize(std::max(size, kWindowBytes));
      window_.resize(read_from(file_, path_, begin, window_));
      if (window_.size() < size) throw shorter(path_);
    }
    return std::span(window_).subspan(begin - window_begin_, size);
  }

  const RegularFile& file_;
  const std::string& path_;
  std::uint64_t position_ = 0, end_ = 0;
  std::vector<std::byte> window_;  // part of the file that starts at window_begin_
  std::uint64_t window_begin_ = 0;
};

McapReader::McapReader(const FilePlace& place) : path_(place.path()), file_(opened(place)) {
  std::string magic(kMagic.size(), '\0');
  read_from(file_, path_, 0, std::as_writable_bytes(std::span(magic)));
  if (magic != kMagic) {
    throw Error("this is not an MCAP file",
                "use a file written by takt::Recorder, or by ros2 bag as MCAP", path_);
  }
  Cursor file(file_, path_);
  file.go_to(kMagic.size());
  read(file, file_.size(), {});
  std::stable_sort(messages_.begin(), messages_.end(),
                   [](const auto& a, const auto& b) { return a.log_time_ns < b.log_time_ns; });
}

std::span<const std::byte> McapReader::bytes(const RecordedMessage& message) {
  if (message.chunk != 0) {
    if (std::exchange(chunk_, message.chunk) != message.chunk) {
      bytes_ = decompressed(chunks_.at(message.chunk));
    }
    return std::span<const std::byte>(bytes_).subspan(message.begin, message.size);
  }
  chunk_ = 0;
  bytes_.resize(message.size);
  if (read_from(file_, path_, message.begin, bytes_) != bytes_.size()) throw shorter(path_);
  return bytes_;
}

// The last record of an incomplete file may be truncated.
void McapReader::read(Cursor& file, std::uint64_t end, const Place& place) {
  for (;;) {
    file.set_end(end);
    if (file.rest() < kRecordHead) return;
    const auto opcode = file.take<std::uint8_t>();
    const auto size = file.take<std::uint64_t>();
    if (size > file.rest()) return;
    if (opcode == kFooter) {
      is_complete_ = is_complete_ || !place.is_in_chunk;
      return;
    }
    const std::uint64_t record_end = file.position() + size;
    file.set_end(record_end);
    read_record(opcode, file, place);
    file.go_to(record_end);
  }
}

void McapReader::read_record(std::uint8_t opcode, Cursor& content, const Place& place) {
  switch (opcode) {
    case kSchema: {
      const auto id = content.take<std::uint16_t>();
      const std::string name = content.text(), encoding = content.text();
      schemas_[id] = {name, encoding == "ros2msg" ? content.text() : ""};
      break;
    }
    case kChannel:
      read_channel(content);
      break;
    case kMessage: {
      if (content.rest() < kMessageHead) break;
      const auto found = channels_.find(content.take<std::uint16_t>());
      if (found == channels_.end()) break;
      RecordedMessage message{.topic = found->second};
      message.sequence = content.take<std::uint32_t>();
      message.log_time_ns = content.take<std::uint64_t>();
      message.publish_time_ns = content.take<std::uint64_t>();
      message.begin = content.position();
      message.size = content.rest();
      message.chunk = place.compressed_chunk;
      messages_.push_back(message);
      break;
    }
    case kChunk:
      if (place.is_in_chunk) {
        throw Error("a chunk contains another chunk", "the file is damaged: record it again",
                    path_);
      }
      read_chunk(content);
      break;
    default:
      break;
  }
}

void McapReader::read_channel(Cursor& content) {
  const auto id = content.take<std::uint16_t>();
  const auto& [type, definition] = schemas_[content.take<std::uint16_t>()];
  const std::string topic = printable(content.text()), encoding = printable(content.text());
  if (encoding != "cdr") {
    throw Error(fmt::format("topic '{}' is encoded as '{}'", topic, encoding),
                "takt supports only 'cdr'", path_);
  }
  std::string qos;
  if (content.take<std::uint32_t>() != 0) {  // the size of the metadata
    while (content.rest() != 0) {
      const std::string key = content.text(), value = content.text();
      if (key == kQosKey) qos = value;
    }
  }
  if (channels_.try_emplace(id, topics_.size()).second) {
    topics_.push_back({topic, printable(type), definition, qos});
  }
}

void McapReader::read_chunk(Cursor& head) {
  for (int i = 0; i < 2; ++i) head.take<std::uint64_t>();  // times
  Content content;
  content.uncompressed = head.take<std::uint64_t>();
  content.crc = head.take<std::uint32_t>();
  content.compression = head.text();
  content.size = head.take<std::uint64_t>();
  content.begin = head.position();
  if (content.size > head.rest()) return;  // the file ends here
  compressions_.insert(content.compression);
  if (content.compression.empty()) {
    check_uncompressed(content);
    return read(head, content.begin + content.size, {.is_in_chunk = true});
  }
  Cursor records(file_, path_, decompressed(content));
  read(records, content.uncompressed, {.is_in_chunk = true, .compressed_chunk = content.begin});
  chunks_[content.begin] = std::move(content);
}

void McapReader::check_uncompressed(const Content& content) const {
  if (content.crc == 0) return;  // it has no checksum
  std::uint32_t crc = 0;
  std::vector<std::byte> window(kWindowBytes);
  for (std::uint64_t done = 0; done < content.size;) {
    const std::span<std::byte> part =
        std::span(window).first(std::min<std::uint64_t>(window.size(), content.size - done));
    if (read_from(file_, path_, content.begin + done, part) != part.size()) throw shorter(path_);
    crc = crc32_of(part, crc);
    done += part.size();
  }
  if (crc != content.crc) damaged(content);
}

std::vector<std::byte> McapReader::decompressed(const Content& content) const {
  if (content.uncompressed > kMostChunkBytes) {
    throw Error(fmt::format("a chunk at byte {} claims to have {} bytes", content.begin,
                            content.uncompressed),
                fmt::format("at most {} are read", kMostChunkBytes), path_);
  }
  std::vector<std::byte> from(content.size), to(content.uncompressed);
  if (read_from(file_, path_, content.begin, from) != from.size()) throw shorter(path_);
  if (!decompress(content.compression, from, to) ||
      (content.crc != 0 && crc32_of(to) != content.crc)) {
    damaged(content);
  }
  return to;
}

void McapReader::damaged(const Content& content) const {
  throw Error(fmt::format("the chunk at byte {} is damaged: its checksum differs", content.begin),
              "copy the file again, or record it again", path_);
}

}  // namespace takt
