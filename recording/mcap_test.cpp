// Compressed chunks, checksums, and files that are damaged or hostile.
// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/testing/eventually.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::ThrowsMessage;

class Mcap : public testing::TestWithParam<std::string> {
 protected:
  ~Mcap() override { std::filesystem::remove(path_); }

  void write(int messages, const std::function<std::string(int)>& text) {
    McapWriter writer(path_, 8192, 2, GetParam());
    const std::size_t a = writer.add({"/a", "p/msg/T", "string data\n", "- depth: 1\n"});
    const std::size_t b = writer.add({"/b", "p/msg/T", "string data\n", ""});
    for (int i = 0; i < messages; ++i) {
      const std::string data = text(i);
      ASSERT_TRUE(eventually([&] {
        return writer.write(i % 3 == 0 ? a : b, 1000 + i, i, std::as_bytes(std::span(data)));
      }));
    }
    EXPECT_TRUE(writer.close());
  }
  std::string file() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void set_file(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
  }
  void expect_error(const std::string& what) const {
    EXPECT_THAT([&] { McapReader reader(path_); }, ThrowsMessage<Error>(HasSubstr(what)));
  }
  // Where the first chunk's record begins: behind the magic bytes and the header.
  static std::size_t chunk_in(const std::string& file) {
    std::uint64_t header = 0;
    std::memcpy(&header, file.data() + 9, sizeof header);
    return 8 + 9 + header;
  }

  const std::string path_ =
      std::filesystem::temp_directory_path() / fmt::format("takt_mcap_{}.mcap", getpid());
};

std::string some_text(int i) {
  return fmt::format("message {} {}", i, std::string(100, 'x'));
}

// It was dropped, with advice that could not help: no buffer of the largest size would have held
// it.
TEST_P(Mcap, HasMessagesOfAnySizeInOrder) {
  const std::string large(100'000'000, 'x');
  write(5, [&](int i) { return i % 2 == 0 ? std::string(10, 'a') : large + std::to_string(i); });
  McapReader reader(path_);
  ASSERT_THAT(reader.messages(), SizeIs(5));
  EXPECT_TRUE(reader.is_complete());
  for (int i = 0; i < 5; ++i) {
    const RecordedMessage& message = reader.messages()[static_cast<std::size_t>(i)];
    EXPECT_EQ(message.log_time_ns, static_cast<std::uint64_t>(1000 + i));
    const auto bytes = reader.bytes(message);
    ASSERT_EQ(bytes.size(), i % 2 == 0 ? 10 : large.size() + 1);
    EXPECT_EQ(static_cast<char>(bytes.back()), i % 2 == 0 ? 'a' : '0' + i);
  }
}

TEST_P(Mcap, WhatWasWrittenIsRead) {
  write(500, some_text);
  McapReader reader(path_);
  EXPECT_TRUE(reader.is_complete());
  EXPECT_THAT(reader.compressions(), ElementsAre(GetParam() == "none" ? "" : GetParam()));
  ASSERT_THAT(reader.topics(), SizeIs(2));
  EXPECT_EQ(reader.topics()[0].qos, "- depth: 1\n");
  EXPECT_EQ(reader.topics()[1].qos, "");
  ASSERT_THAT(reader.messages(), SizeIs(500));
  for (int step : {1, 77}) {  // forwards, and to and fro between chunks
    for (int i = 0; i < 500; ++i) {
      const RecordedMessage& message = reader.messages()[static_cast<std::size_t>(i * step % 500)];
      const auto bytes = reader.bytes(message);
      EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
                some_text(i * step % 500));
    }
  }
}

TEST_P(Mcap, ADamagedChunkIsAnError) {
  write(500, some_text);
  const std::string whole = file();
  std::string damaged = whole;
  char& inside = damaged[chunk_in(whole) + 200];
  inside = static_cast<char>(inside ^ 4);
  set_file(damaged);
  expect_error("is damaged: its checksum differs");
}

TEST_P(Mcap, AFileThatEndsEarlyIsReadSoFar) {
  write(500, some_text);
  const std::string whole = file();
  const std::size_t all = McapReader(path_).messages().size();
  std::size_t before = 0;
  for (std::size_t size = chunk_in(whole); size < whole.size(); size += whole.size() / 20) {
    set_file(whole.substr(0, size));
    const McapReader reader(path_);
    EXPECT_FALSE(reader.is_complete());
    EXPECT_GE(reader.messages().size(), before);
    before = reader.messages().size();
  }
  EXPECT_GT(before, 0u);
  EXPECT_LE(before, all);
}

TEST_P(Mcap, AChunkThatClaimsTooMuchIsRefused) {
  if (GetParam() == "none") GTEST_SKIP() << "there its size is that of the record";
  write(500, some_text);
  const std::string whole = file();
  const std::size_t head = chunk_in(whole) + 9;
  for (const auto& [bytes, what] : {std::pair(std::uint64_t{1} << 40, "claims to have"),
                                    {std::uint64_t{1} << 20, "is damaged"},
                                    {std::uint64_t{10}, "is damaged"}}) {
    std::string hostile = whole;
    std::memcpy(hostile.data() + head + 16, &bytes, sizeof bytes);
    set_file(hostile);
    expect_error(what);
  }
  std::string hostile = whole;
  hostile[head + 32] = 'x';  // the first letter of its name
  set_file(hostile);
  expect_error("is compressed by 'x");
}

INSTANTIATE_TEST_SUITE_P(Every, Mcap, testing::Values("none", "lz4", "zstd"),
                         [](const auto& name) { return name.param; });

TEST(McapWriter, RefusesOtherCompressions) {
  EXPECT_THAT([] { McapWriter writer("/dev/null", 8192, 2, "gzip"); },
              ThrowsMessage<Error>(HasSubstr("gzip")));
}

}  // namespace
}  // namespace takt
