// SPDX-License-Identifier: Apache-2.0
#include "takt/base/printable.hpp"

#include <gtest/gtest.h>

namespace takt {
namespace {

using namespace std::literals;

TEST(Printable, LeavesTextAsItIs) {
  for (const char* text : {"", "/front/scan", "3 \u00b5s \u2026 \u65e5\u672c \U0001f916", "a\\b"}) {
    EXPECT_EQ(printable(text), text);
  }
}

// A node named by an escape sequence set the title of the terminal; one with line breaks added
// lines to the log and to tables.
TEST(Printable, EscapesWhatSteersATerminal) {
  EXPECT_EQ(printable("ev\x1b]0;owned\x07il"), "ev\\u001b]0;owned\\u0007il");
  EXPECT_EQ(printable("a\nb\r\t\0c\x7f"sv), "a\\nb\\r\\t\\u0000c\\u007f");
  EXPECT_EQ(printable("\u009b31m \u202egnp \u2028"), "\\u009b31m \\u202egnp \\u2028");
  EXPECT_EQ(printable("a\n\tb\x1b", Lines::keep), "a\n\tb\\u001b");
}

TEST(Printable, EscapesBytesThatAreNoUtf8) {
  EXPECT_EQ(printable("\xff\xfe"), "\\xff\\xfe");
  EXPECT_EQ(printable("\xc3\xa4\xc3"), "\xc3\xa4\\xc3");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");           // longer than necessary
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // half a pair
  EXPECT_EQ(printable("\xf5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");
}

}  // namespace
}  // namespace takt
