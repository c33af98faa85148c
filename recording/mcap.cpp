// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "takt/base/version.hpp"
#include "takt/recording/mcap_format.hpp"

namespace takt {
namespace {

using namespace mcap;

template <class T>
void put(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put_text(std::string& to, std::string_view text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to += text;
}
std::string record(Opcode opcode, const std::string& content) {
  std::string result(1, static_cast<char>(opcode));
  put(result, static_cast<std::uint64_t>(content.size()));
  return result += content;
}

std::string head() {
  std::string content;
  put_text(content, "ros2");
  put_text(content, "takt " TAKT_VERSION);
  return std::string(kMagic) + record(kHeader, content);
}

// Numbers start at 1: schema 0 means "no schema".
std::uint16_t number(std::size_t topic) {
  return static_cast<std::uint16_t>(topic + 1);
}
std::string schema(std::size_t topic, const RecordedTopic& of) {
  std::string content;
  put(content, number(topic));
  put_text(content, of.type);
  put_text(content, of.definition.empty() ? "" : "ros2msg");
  put_text(content, of.definition);
  return record(kSchema, content);
}
std::string channel(std::size_t topic, const RecordedTopic& of) {
  std::string content;
  put(content, number(topic));
  put(content, number(topic));
  put_text(content, of.topic);
  put_text(content, "cdr");
  std::string metadata;
  if (!of.qos.empty()) {
    put_text(metadata, kQosKey);
    put_text(metadata, of.qos);
  }
  put_text(content, metadata);
  return record(kChannel, content);
}

template <class T>
void store(std::byte*& to, T value) noexcept {
  std::memcpy(to, &value, sizeof value);
  to += sizeof value;
}

}  // namespace

// ---- Writing ----

McapWriter::McapWriter(const FilePlace& place, std::size_t buffer_bytes, std::size_t buffers,
                       const std::string& compression)
    : file_(place, buffer_bytes, buffers), compressor_(compression, buffer_bytes) {
  const std::string begin = head();
  std::memcpy(file_.buffer().data(), begin.data(), begin.size());
  pass_on(begin.size());
}

McapWriter::~McapWriter() {
  close();
}

std::size_t McapWriter::add(RecordedTopic topic) {
  topics_.push_back({std::move(topic)});
  return topics_.size() - 1;
}

void McapWriter::define(std::size_t topic, std::string definition) {
  topics_[topic].topic.definition = std::move(definition);
}

bool McapWriter::begin_chunk() noexcept {
  if (used_ != 0) return true;
  if (file_.error() != 0 || file_.buffer().empty()) return false;
  used_ = kRecordHead + kChunkHead;
  index_bytes_ = 0;
  current_ = {.begin = file_.offset()};
  return true;
}

void McapWriter::pass_on(std::size_t bytes) noexcept {
  crc_ = crc32_of(file_.buffer().first(bytes), crc_);
  file_.write(bytes);
}

bool McapWriter::write(std::size_t topic, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
                       std::span<const std::byte> bytes) noexcept {
  Topic& of = topics_[topic];
  std::string about;
  if (!of.is_written) about = schema(topic, of.topic) + channel(topic, of.topic);
  const std::size_t wanted = about.size() + kRecordHead + kMessageHead + bytes.size();
  constexpr std::size_t kOwnIndex = kMessageIndexHead + kMessageIndexEntry;
  constexpr std::size_t kOwnChunk = kRecordHead + kChunkHead + kOwnIndex;
  const std::size_t room = file_.buffer_bytes();
  const bool is_long = wanted + kOwnChunk > room;  // it gets a buffer, and so a chunk, of its own
  if (is_closed_) return false;
  if (is_long || used_ + index_bytes_ + wanted + kOwnIndex > room) flush();
  if (is_long && (file_.error() != 0 || !file_.make_own(wanted + kOwnChunk))) return false;
  if (!begin_chunk()) return false;
  if (of.index.empty()) index_bytes_ += kMessageIndexHead;
  index_bytes_ += kMessageIndexEntry;
  of.index.emplace_back(log_time_ns, used_ + about.size() - kRecordHead - kChunkHead);
  std::byte* to = file_.buffer().data() + used_;
  to = std::copy_n(reinterpret_cast<const std::byte*>(about.data()), about.size(), to);
  store(to, std::uint8_t{kMessage});
  store(to, static_cast<std::uint64_t>(kMessageHead + bytes.size()));
  store(to, number(topic));
  store(to, static_cast<std::uint32_t>(++of.messages));
  store(to, log_time_ns);
  store(to, publish_time_ns);
  std::copy(bytes.begin(), bytes.end(), to);
  used_ += wanted;
  of.is_written = true;
  if (current_.messages++ == 0) current_.first_ns = current_.last_ns = log_time_ns;
  current_.first_ns = std::min(current_.first_ns, log_time_ns);
  current_.last_ns = std::max(current_.last_ns, log_time_ns);
  if (is_long) flush();
  return true;
}

void McapWriter::flush() noexcept {
  if (used_ == 0) return;
  const std::byte* const begin = file_.buffer().data();
  std::byte* const index = end_chunk();
  current_.index = current_.begin + static_cast<std::uint64_t>(index - begin);
  const std::byte* const end = write_indexes(index);
  used_ = 0;
  pass_on(static_cast<std::size_t>(end - begin));
  current_.end = file_.offset();
  chunks_.push_back(current_);
}

// Compresses it if that makes it smaller. Returns the end of the record.
std::byte* McapWriter::end_chunk() noexcept {
  std::byte* to = file_.buffer().data();
  const std::span<const std::byte> records =
      file_.buffer().first(used_).subspan(kRecordHead + kChunkHead);
  const std::uint32_t crc = crc32_of(records);
  std::span<const std::byte> content = compressor_.compress(records);
  const bool is_smaller =
      !content.empty() && content.size() + compressor_.name().size() < records.size();
  if (is_smaller) current_.compression = compressor_.name();
  if (!is_smaller) content = records;
  current_.uncompressed = records.size();
  current_.compressed = content.size();
  store(to, std::uint8_t{kChunk});
  store(to, kChunkHead + current_.compression.size() + content.size());
  store(to, current_.first_ns);
  store(to, current_.last_ns);
  store(to, current_.uncompressed);
  store(to, crc);
  store(to, static_cast<std::uint32_t>(current_.compression.size()));
  std::memcpy(to, current_.compression.data(), current_.compression.size());
  to += current_.compression.size();
  store(to, current_.compressed);
  if (is_smaller) std::memcpy(to, content.data(), content.size());
  return to + content.size();
}

std::byte* McapWriter::write_indexes(std::byte* to) noexcept {
  const std::byte* const begin = to;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    auto& index = topics_[i].index;
    if (index.empty()) continue;
    current_.indexes[number(i)] = current_.index + static_cast<std::uint64_t>(to - begin);
    const std::size_t bytes = index.size() * kMessageIndexEntry;
    store(to, std::uint8_t{kMessageIndex});
    store(to, static_cast<std::uint64_t>(kMessageIndexHead - kRecordHead + bytes));
    store(to, number(i));
    store(to, static_cast<std::uint32_t>(bytes));
    for (const auto& [time_ns, place] : index) {
      store(to, time_ns);
      store(to, place);
    }
    index.clear();
  }
  return to;
}

std::uint64_t McapWriter::messages() const noexcept {
  std::uint64_t sum = used_ != 0 ? current_.messages : 0;
  for (const Chunk& chunk : chunks_) sum += chunk.messages;
  return sum;
}

std::string McapWriter::chunk_index(const Chunk& chunk) {
  std::string content;
  put(content, chunk.first_ns);
  put(content, chunk.last_ns);
  put(content, chunk.begin);
  put(content, chunk.index - chunk.begin);
  std::string places;
  for (const auto& [topic, place] : chunk.indexes) {
    put(places, topic);
    put(places, place);
  }
  put_text(content, places);
  put(content, chunk.end - chunk.index);
  put_text(content, chunk.compression);
  put(content, chunk.compressed);
  put(content, chunk.uncompressed);
  return record(kChunkIndex, content);
}

std::string McapWriter::summary() const {
  std::string data_end, schemas, channels, indexes, statistics, counts;
  put(data_end, crc_);
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (!topics_[i].is_written) continue;
    schemas += schema(i, topics_[i].topic);
    channels += channel(i, topics_[i].topic);
    put(counts, number(i));
    put(counts, topics_[i].messages);
  }
  std::uint64_t first_ns = 0, last_ns = 0;
  for (const Chunk& chunk : chunks_) {
    first_ns = first_ns == 0 ? chunk.first_ns : std::min(first_ns, chunk.first_ns);
    last_ns = std::max(last_ns, chunk.last_ns);
    indexes += chunk_index(chunk);
  }
  const std::size_t written = counts.size() / 10;
  put(statistics, messages());
  put(statistics, static_cast<std::uint16_t>(written));
  put(statistics, static_cast<std::uint32_t>(written));
  put(statistics, std::uint32_t{0});  // attachments
  put(statistics, std::uint32_t{0});  // metadata
  put(statistics, static_cast<std::uint32_t>(chunks_.size()));
  put(statistics, first_ns);
  put(statistics, last_ns);
  put_text(statistics, counts);

  std::string text = record(kDataEnd, data_end);
  const std::uint64_t begin = file_.offset() + text.size();
  std::string offsets;
  for (const auto& [opcode, group] :
       {std::pair(kSchema, schemas), std::pair(kChannel, channels),
        std::pair(kStatistics, record(kStatistics, statistics)), std::pair(kChunkIndex, indexes)}) {
    if (group.empty()) continue;
    std::string content(1, static_cast<char>(opcode));
    put(content, file_.offset() + text.size());
    put(content, static_cast<std::uint64_t>(group.size()));
    offsets += record(kSummaryOffset, content);
    text += group;
  }
  std::string footer;
  put(footer, begin);
  put(footer, file_.offset() + text.size());
  put(footer, std::uint32_t{0});
  const std::size_t summary_begin = begin - file_.offset();
  text += offsets + record(kFooter, footer);
  // Of the summary, up to the checksum in the footer.
  const std::size_t place = text.size() - sizeof(std::uint32_t);
  const std::uint32_t crc =
      crc32_of(std::as_bytes(std::span(text)).subspan(summary_begin, place - summary_begin));
  std::memcpy(text.data() + place, &crc, sizeof crc);
  return text + std::string(kMagic);
}

bool McapWriter::close() noexcept {
  if (std::exchange(is_closed_, true)) return file_.error() == 0;
  flush();
  const bool is_whole = file_.finish();
  // Omit the missing chunks, and one more to make room for the end of the file.
  if (!is_whole) {
    const std::uint64_t taken = messages();
    while (!chunks_.empty() && chunks_.back().end > file_.written()) chunks_.pop_back();
    if (!chunks_.empty()) chunks_.pop_back();
    lost_ = taken - messages();
    file_.cut(chunks_.empty() ? file_.written() : chunks_.back().end);
    crc_ = 0;  // none: that of what is left is not known
  }
  const std::string end = summary();
  for (std::size_t done = 0; done < end.size();) {
    const std::span<std::byte> buffer = file_.buffer();
    if (buffer.empty()) {
      if (!file_.finish()) break;
      continue;
    }
    const std::size_t size = std::min(buffer.size(), end.size() - done);
    std::memcpy(buffer.data(), end.data() + done, size);
    file_.write(size);
    done += size;
  }
  return file_.complete() && is_whole;
}

}  // namespace takt
