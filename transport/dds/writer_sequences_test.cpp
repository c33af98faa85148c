// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/writer_sequences.hpp"

#include <gtest/gtest.h>

namespace takt {
namespace {

constexpr auto kAll = [](std::uint64_t) { return true; };

ChunkHeader chunk(std::uint64_t writer, std::uint64_t sequence, std::uint64_t before = 0) {
  return {.writer = writer, .sequence = sequence, .before = before};
}

TEST(WriterSequences, CountWhatWasOverwrittenBetweenTwoMessagesOfAWriter) {
  WriterSequences sequences;
  EXPECT_EQ(sequences.overwritten(chunk(7, 4, 1), 70, kAll), 2u);  // 2 and 3
  EXPECT_EQ(sequences.overwritten(chunk(8, 1), 80, kAll), 0u);
  EXPECT_EQ(sequences.overwritten(chunk(7, 5, 1), 70, kAll), 0u);
  EXPECT_EQ(sequences.overwritten(chunk(7, 9, 1), 70, kAll), 3u);
  EXPECT_EQ(sequences.overwritten(chunk(7, 9, 1), 70, kAll), 0u) << "no number that comes again";
}

TEST(WriterSequences, ForgetWritersThatHaveGone) {
  WriterSequences sequences;
  std::uint64_t alive = 0;
  const auto is_alive = [&](std::uint64_t handle) { return handle == 1 || handle == alive; };
  EXPECT_EQ(sequences.overwritten(chunk(1, 1), 1, is_alive), 0u);
  for (alive = 2; alive < 1000; ++alive) {
    EXPECT_EQ(sequences.overwritten(chunk(alive, 1), alive, is_alive), 0u);
    EXPECT_EQ(sequences.writers(), 2u);
  }
  EXPECT_EQ(sequences.overwritten(chunk(1, 3), 1, is_alive), 1u);
}

}  // namespace
}  // namespace takt
