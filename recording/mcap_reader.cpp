// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/recording/mcap.hpp"
#include "takt/recording/mcap_format.hpp"

namespace takt {
namespace {

using namespace mcap;

// Size of one read for messages that are close together.
constexpr std::size_t kWindowBytes = 256 << 10;

RegularFile opened(const std::string& path) {
  try {
    return RegularFile(path);
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
      window_.resize(file_.read(begin, window_));
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

McapReader::McapReader(const std::string& path) : path_(path), file_(opened(path)) {
  std::string magic(kMagic.size(), '\0');
  file_.read(0, std::as_writable_bytes(std::span(magic)));
  if (magic != kMagic) {
    throw Error("this is no MCAP file",
                "use a file written by takt::Recorder, or by ros2 bag as MCAP", path);
  }
  Cursor file(file_, path_);
  file.go_to(kMagic.size());
  read(file, file_.size(), false);
  std::stable_sort(messages_.begin(), messages_.end(),
                   [](const auto& a, const auto& b) { return a.log_time_ns < b.log_time_ns; });
}

std::span<const std::byte> McapReader::bytes(const RecordedMessage& message) {
  bytes_.resize(message.size);
  if (file_.read(message.begin, bytes_) != bytes_.size()) throw shorter(path_);
  return bytes_;
}

// The last record of an incomplete file may be truncated.
void McapReader::read(Cursor& file, std::uint64_t end, bool is_in_chunk) {
  for (;;) {
    file.set_end(end);
    if (file.rest() < kRecordHead) return;
    const auto opcode = file.take<std::uint8_t>();
    const auto size = file.take<std::uint64_t>();
    if (size > file.rest()) return;
    if (opcode == kFooter) {
      is_complete_ = is_complete_ || !is_in_chunk;
      return;
    }
    const std::uint64_t record_end = file.position() + size;
    file.set_end(record_end);
    read_record(opcode, file, is_in_chunk);
    file.go_to(record_end);
  }
}

void McapReader::read_record(std::uint8_t opcode, Cursor& content, bool is_in_chunk) {
  switch (opcode) {
    case kSchema: {
      const auto id = content.take<std::uint16_t>();
      const std::string name = content.text(), encoding = content.text();
      schemas_[id] = {name, encoding == "ros2msg" ? content.text() : ""};
      break;
    }
    case kChannel: {
      const auto id = content.take<std::uint16_t>();
      const auto& [type, definition] = schemas_[content.take<std::uint16_t>()];
      const std::string topic = content.text(), encoding = content.text();
      if (encoding != "cdr") {
        throw Error(fmt::format("topic '{}' is encoded as '{}'", topic, encoding),
                    "takt supports only 'cdr'", path_);
      }
      if (channels_.try_emplace(id, topics_.size()).second) {
        topics_.push_back({topic, type, definition});
      }
      break;
    }
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
      messages_.push_back(message);
      break;
    }
    case kChunk: {
      if (is_in_chunk) {
        throw Error("a chunk contains another chunk", "the file is damaged: record it again",
                    path_);
      }
      for (int i = 0; i < 3; ++i) content.take<std::uint64_t>();  // times, size
      content.take<std::uint32_t>();                              // checksum
      if (const std::string compression = content.text(); !compression.empty()) {
        throw Error(fmt::format("the recording is compressed by {}", compression),
                    "decompress it with: mcap decompress", path_);
      }
      const auto size = content.take<std::uint64_t>();
      if (size <= content.rest()) read(content, content.position() + size, true);
      break;
    }
    default:
      break;
  }
}

}  // namespace takt
