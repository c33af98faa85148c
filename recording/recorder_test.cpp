// What is recorded is in the file, is played byte for byte, and what cannot be written is counted.
// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/recorder.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/recording/player.hpp"
#include "takt/transport/messages/std_msgs.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::ThrowsMessage;

std::vector<std::byte> encoded(const std::string& text) {
  ByteBuffer bytes;
  const std_msgs::String message{text};
  message_type<std_msgs::String>().encode(&message, bytes);
  return {bytes.bytes().begin(), bytes.bytes().end()};
}
std::string decoded(std::span<const std::byte> bytes) {
  std_msgs::String message;
  EXPECT_TRUE(message_type<std_msgs::String>().decode(bytes, &message));
  return message.data;
}

class RecordingTest : public testing::Test {
 protected:
  RecordingTest() { std::filesystem::create_directories(folder_); }
  ~RecordingTest() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }
  NodeOptions options(Parameters parameters) {
    return {.parameters = std::move(parameters), .clock = &clock_};
  }
  void run(Nanoseconds duration) {
    for (Nanoseconds done{0}; done < duration; done += 1ms) {
      clock_.advance(1ms);
      executor_->spin_all();
    }
  }
  std::vector<std::string> recorded(const std::string& file) const {
    const McapReader reader(path(file));
    std::vector<std::string> result;
    for (const RecordedMessage& message : reader.messages()) {
      result.push_back(reader.topics()[message.topic].topic + " " + decoded(message.bytes));
    }
    return result;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("takt_recording_" + std::to_string(getpid()));
  ManualClock clock_;
  const std::unique_ptr<Executor> executor_ =
      executors().make("events", {.name = "recording", .clock = &clock_});
};

TEST_F(RecordingTest, AFileHasWhatWasWritten) {
  {
    McapWriter writer(path("a"), 4096, 2);
    const std::size_t chatter = writer.add({"/chatter", "std_msgs/msg/String", "string data\n"});
    const std::size_t other = writer.add({"/other", "std_msgs/msg/String", ""});
    for (int i = 0; i < 200; ++i) {  // several chunks
      while (!writer.write(i % 2 == 0 ? chatter : other, 1000 + i, 900 + i,
                           encoded(fmt::format("message {}", i)))) {
      }
    }
    EXPECT_FALSE(writer.write(chatter, 0, 0, std::vector<std::byte>(5000)));  // fits into none
    EXPECT_TRUE(writer.close());
    EXPECT_EQ(writer.messages(), 200u);
  }
  const McapReader reader(path("a"));
  EXPECT_TRUE(reader.is_complete());
  ASSERT_THAT(reader.topics(), SizeIs(2));
  EXPECT_EQ(reader.topics()[0].topic, "/chatter");
  EXPECT_EQ(reader.topics()[0].type, "std_msgs/msg/String");
  EXPECT_EQ(reader.topics()[0].definition, "string data\n");
  ASSERT_THAT(reader.messages(), SizeIs(200));
  const RecordedMessage& last = reader.messages().back();
  EXPECT_EQ(decoded(last.bytes), "message 199");
  EXPECT_EQ(last.log_time_ns, 1199u);
  EXPECT_EQ(last.publish_time_ns, 1099u);
  EXPECT_EQ(last.sequence, 100u);
}

TEST_F(RecordingTest, AFileThatEndsInTheMiddleIsReadSoFar) {
  {
    McapWriter writer(path("a"), 4096, 2);
    const std::size_t chatter = writer.add({"/chatter", "std_msgs/msg/String", ""});
    for (int i = 0; i < 200; ++i) {
      while (!writer.write(chatter, i, i, encoded("some text that takes its place"))) {
      }
    }
  }
  std::filesystem::resize_file(path("a"), std::filesystem::file_size(path("a")) / 2);
  const McapReader reader(path("a"));
  EXPECT_FALSE(reader.is_complete());
  EXPECT_GT(reader.messages().size(), 50u);
  EXPECT_LT(reader.messages().size(), 150u);
}

TEST_F(RecordingTest, WhatIsNoRecordingIsRefused) {
  std::ofstream(path("text")) << "no recording";
  std::ofstream(path("empty"));
  for (const char* name : {"text", "empty"}) {
    EXPECT_THAT([&] { McapReader reader(path(name)); },
                ThrowsMessage<Error>(HasSubstr("no MCAP file")));
  }
  EXPECT_THAT([&] { McapReader reader(path("nothing")); },
              ThrowsMessage<Error>(HasSubstr("cannot be read")));
  EXPECT_THAT([&] { McapWriter writer(path("no/such/folder"), 4096, 2); },
              ThrowsMessage<Error>(HasSubstr("cannot be written")));
}

TEST_F(RecordingTest, RecordsByPointerAndPlaysByteForByte) {
  const auto node = std::make_shared<Node>("talker", NodeOptions{.clock = &clock_});
  const auto early = node->create_publisher<std_msgs::String>("early", 10, {.loans = 4});
  auto recorder = std::make_shared<Recorder>(options({{"file", path("a")}}));
  executor_->add_node(recorder);
  const auto late = node->create_publisher<std_msgs::String>("late", 10, {.loans = 4});
  early->publish(std_msgs::String{"1"});
  run(300ms);  // finds what has come later
  late->publish(std_msgs::String{"2"});
  early->publish(std_msgs::String{"3"});
  run(1ms);
  EXPECT_EQ(recorder->recorded(), 3u);
  run(2s);  // is written without more to come
  for (int i = 0; i < 10'000 && std::filesystem::file_size(path("a")) < 100; ++i) {
    std::this_thread::sleep_for(1ms);  // the kernel writes when it likes
  }
  EXPECT_GT(std::filesystem::file_size(path("a")), 100u);
  executor_->remove_node(recorder);
  recorder.reset();
  EXPECT_THAT(recorded("a"), ElementsAre("/early 1", "/late 2", "/early 3"));
  {
    const McapReader reader(path("a"));
    EXPECT_EQ(reader.topics()[0].definition, "string data\n");
  }
  // What is played is recorded again, from bytes.
  recorder = std::make_shared<Recorder>(
      options({{"file", path("b")}, {"topics", std::vector<std::string>{"/early", "late"}}}));
  const auto player = std::make_shared<Player>(options({{"file", path("a")}, {"rate", 100.0}}));
  executor_->add_node(recorder);
  executor_->add_node(player);
  run(1s);
  executor_->remove_node(recorder);
  recorder.reset();
  EXPECT_EQ(recorded("b"), recorded("a"));
}

TEST_F(RecordingTest, AFullDiskEndsTheRecordingAndIsCounted) {
  std::vector<std::string> lines;
  Logger::instance().flush();  // what tests before have logged
  Logger::instance().set_writer([&](LogLevel, std::string_view line) { lines.emplace_back(line); });
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{200'000, before.rlim_max};
  const auto node = std::make_shared<Node>("talker", NodeOptions{.clock = &clock_});
  const auto publisher = node->create_publisher<std_msgs::String>("chatter", 10, {.loans = 4});
  auto recorder =
      std::make_shared<Recorder>(options({{"file", path("a")},
                                          {"buffer_bytes", 32768},
                                          {"topics", std::vector<std::string>{"chatter"}}}));
  executor_->add_node(recorder);
  setrlimit(RLIMIT_FSIZE, &small);
  std::uint64_t sent = 0;
  while (!recorder->has_ended() && sent < 1'000'000) {
    publisher->publish(std_msgs::String{std::string(1000, 'x')});
    ++sent;
    run(1ms);
  }
  EXPECT_TRUE(recorder->has_ended());
  executor_->remove_node(recorder);
  recorder.reset();
  setrlimit(RLIMIT_FSIZE, &before);
  Logger::instance().flush();
  Logger::instance().set_writer({});
  const McapReader reader(path("a"));
  EXPECT_TRUE(reader.is_complete());
  EXPECT_GT(reader.messages().size(), 30u);
  EXPECT_THAT(lines, testing::Contains(HasSubstr("the recording ends here")));
  EXPECT_THAT(lines, testing::Contains(HasSubstr(fmt::format("{} messages of 1 topics, {} dropped",
                                                             reader.messages().size(),
                                                             sent - reader.messages().size()))));
}

}  // namespace
}  // namespace takt
