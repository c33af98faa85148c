// Tests of the connection between a parent process and a child.
// SPDX-License-Identifier: Apache-2.0
#include "run/channel.hpp"

#include <memory>
#include <string_view>
#include <thread>

#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using nlohmann::json;

class ChannelPair : public testing::Test {
 protected:
  ChannelPair() {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) throw std::runtime_error("no sockets");
    here_ = std::make_unique<Channel>(ends[0]);
    there_ = std::make_unique<Channel>(ends[1]);
  }
  void write_raw(std::string_view text) {
    ASSERT_EQ(write(here_->fd(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  std::unique_ptr<Channel> here_, there_;
};

TEST_F(ChannelPair, BringsDocumentsInOrder) {
  EXPECT_TRUE(here_->send({{"number", 1}}));
  EXPECT_TRUE(here_->send("two\nlines"));
  EXPECT_EQ(there_->receive(), json({{"number", 1}}));
  EXPECT_EQ(there_->receive(), json("two\nlines"));
  EXPECT_EQ(there_->next(), std::nullopt);
}

TEST_F(ChannelPair, PutsADocumentTogetherThatComesInPieces) {
  write_raw("[1,");
  ASSERT_TRUE(there_->read_some());
  EXPECT_EQ(there_->next(), std::nullopt);
  write_raw("2]\n[3");
  ASSERT_TRUE(there_->read_some());
  EXPECT_EQ(there_->next(), json({1, 2}));
  EXPECT_EQ(there_->next(), std::nullopt);
}

TEST_F(ChannelPair, BringsOneThatIsLargerThanAnyBuffer) {
  const json large = std::string(5'000'000, 'x');
  std::thread sender([&] { EXPECT_TRUE(here_->send(large)); });
  EXPECT_EQ(there_->receive(), large);
  sender.join();
}

TEST_F(ChannelPair, SaysWhenTheOtherHasGone) {
  EXPECT_TRUE(here_->send(1));
  here_.reset();
  EXPECT_EQ(there_->receive(), json(1));
  EXPECT_EQ(there_->receive(), std::nullopt);
  EXPECT_FALSE(there_->send(2));
}

TEST_F(ChannelPair, MayStillHearAfterItHasFinished) {
  here_->finish();
  EXPECT_EQ(there_->receive(), std::nullopt);
  EXPECT_TRUE(there_->send("late"));
  EXPECT_EQ(here_->receive(), json("late"));
}

}  // namespace
}  // namespace takt::tools
