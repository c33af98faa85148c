// What is recorded is in the file, is played byte for byte, and what cannot be written is counted.
// SPDX-License-Identifier: Apache-2.0
#include "takt/components/recorder.hpp"

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/counted.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/components/player.hpp"
#include "takt/executors/executor.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/outside.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::ThrowsMessage;

std::vector<std::byte> encoded(const std::string& text) {
  ByteBuffer bytes;
  const auto message = std_msgs::msg::String().set__data(text);
  message_type<std_msgs::msg::String>().encode(&message, bytes);
  return {bytes.bytes().begin(), bytes.bytes().end()};
}
std::string decoded(std::span<const std::byte> bytes) {
  std_msgs::msg::String message;
  EXPECT_TRUE(message_type<std_msgs::msg::String>().decode(bytes, &message));
  return message.data;
}

// For this thread, as a container without rights does.
bool refuse_io_uring() {
  sock_filter filter[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_io_uring_setup, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog program{std::size(filter), filter};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

/// What is logged while it lives.
class Lines {
 public:
  Lines() {
    Logger::instance().flush();  // what tests before have logged
    Logger::instance().set_writer(
        [this](LogLevel, std::string_view line) { lines_.emplace_back(line); });
  }
  ~Lines() {
    Logger::instance().flush();
    Logger::instance().set_writer({});
  }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;
  const std::vector<std::string>& get() const {
    Logger::instance().flush();
    return lines_;
  }

 private:
  std::vector<std::string> lines_;
};

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
    McapReader reader(path(file));
    std::vector<std::string> result;
    for (const RecordedMessage& message : reader.messages()) {
      result.push_back(reader.topics()[message.topic].topic + " " + decoded(reader.bytes(message)));
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
      ASSERT_TRUE(eventually([&] {
        return writer.write(i % 2 == 0 ? chatter : other, 1000 + i, 900 + i,
                            encoded(fmt::format("message {}", i)));
      }));
    }
    EXPECT_TRUE(writer.close());
    EXPECT_EQ(writer.messages(), 200u);
  }
  McapReader reader(path("a"));
  EXPECT_TRUE(reader.is_complete());
  ASSERT_THAT(reader.topics(), SizeIs(2));
  EXPECT_EQ(reader.topics()[0].topic, "/chatter");
  EXPECT_EQ(reader.topics()[0].type, "std_msgs/msg/String");
  EXPECT_EQ(reader.topics()[0].definition, "string data\n");
  ASSERT_THAT(reader.messages(), SizeIs(200));
  const RecordedMessage& last = reader.messages().back();
  EXPECT_EQ(decoded(reader.bytes(last)), "message 199");
  EXPECT_EQ(last.log_time_ns, 1199u);
  EXPECT_EQ(last.publish_time_ns, 1099u);
  EXPECT_EQ(last.sequence, 100u);
}

TEST_F(RecordingTest, AFileThatEndsInTheMiddleIsReadSoFar) {
  {
    McapWriter writer(path("a"), 4096, 2);
    const std::size_t chatter = writer.add({"/chatter", "std_msgs/msg/String", ""});
    for (int i = 0; i < 200; ++i) {
      ASSERT_TRUE(eventually(
          [&] { return writer.write(chatter, i, i, encoded("some text that takes its place")); }));
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
                ThrowsMessage<Error>(HasSubstr("not an MCAP file")));
  }
  EXPECT_THAT([&] { McapReader reader(path("nothing")); },
              ThrowsMessage<Error>(HasSubstr("cannot be read")));
  EXPECT_THAT([&] { McapWriter writer(path("no/such/folder"), 4096, 2); },
              ThrowsMessage<Error>(HasSubstr("cannot be written")));
}

// Opening one would wait for a writer.
TEST_F(RecordingTest, AFifoIsRefused) {
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  EXPECT_THAT(
      [&] { McapReader reader(path("fifo")); },
      ThrowsMessage<Error>(HasSubstr("fifo: this is a FIFO or a pipe; name a regular file")));
  EXPECT_THAT([&] { McapWriter writer(path("fifo"), 4096, 2); },
              ThrowsMessage<Error>(HasSubstr("this is a FIFO")));
}

// `takt analyze` emptied the last recording: it made the recorder to see its callbacks.
TEST_F(RecordingTest, ARecorderThatIsOnlyConstructedWritesNothing) {
  { const Recorder recorder(options({{"file", path("old.mcap")}})); }
  const auto content = [&] {
    std::ifstream file(path("old.mcap"));
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string before = content();
  ASSERT_GT(before.size(), 100u);
  std::ofstream(path("precious")) << "precious";
  const auto make = [&](const std::string& file) {
    NodeOptions only = options({{"file", path(file)}});
    only.is_only_constructed = true;
    const Lines lines;
    { const Recorder recorder(only); }
    EXPECT_THAT(lines.get(), ElementsAre());
  };
  make("old.mcap");
  EXPECT_EQ(content(), before);
  make("new.mcap");
  EXPECT_FALSE(std::filesystem::exists(path("new.mcap")));
  EXPECT_THAT([&] { make("precious"); }, ThrowsMessage<Error>(HasSubstr("takt did not write it")));
  EXPECT_THAT([&] { make("no_such_folder/a"); }, ThrowsMessage<Error>(HasSubstr("no_such_folder")));
}

// A request could name any file: a recorder in a container of root's overwrote root's scripts with
// what anybody published, and a player published what only root may read.
TEST_F(RecordingTest, ARequestUsesFilesBeneathTheFolderForRecordingsOnly) {
  const auto asked = [&](const std::string& file, const std::string& folder) {
    NodeOptions options = this->options({{"file", file}});
    options.guest = Guest{folder};
    return options;
  };
  const auto error_of = [](const auto& make) -> std::string {
    try {
      make();
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  };
  std::filesystem::create_directory(path("own"));
  std::ofstream(path("precious")) << "precious";
  { const Recorder recorder(options({{"file", path("old.mcap")}})); }
  std::filesystem::create_symlink(path("precious"), path("own/link"));
  std::filesystem::create_symlink(folder_, path("own/up"));
  std::ofstream(path("own/there")) << "there";
  ASSERT_EQ(mkfifo(path("own/fifo").c_str(), 0600), 0);

  const auto record = [&](const std::string& file, const std::string& folder) {
    return error_of([&] { Recorder recorder(asked(file, folder)); });
  };
  const auto play = [&](const std::string& file, const std::string& folder) {
    return error_of([&] { Player player(asked(file, folder)); });
  };
  for (const std::string& file : {path("precious"), std::string("a"), std::string("../a")}) {
    EXPECT_THAT(record(file, ""), HasSubstr("`load: {recordings: DIR}`")) << file;
    EXPECT_THAT(play(file, ""), HasSubstr("`takt run --name NAME --recordings DIR`")) << file;
  }
  for (const std::string& file :
       {path("own/new"), path("precious"), std::string("../precious"), std::string("up/precious"),
        std::string("link"), std::string("there"), std::string("fifo"), std::string("."),
        std::string("/proc/self/mem"), std::string("../own/new")}) {
    EXPECT_NE(record(file, path("own")), "no error") << file;
  }
  for (const char* file : {"../old.mcap", "up/old.mcap", "fifo", "."}) {
    EXPECT_NE(play(file, path("own")), "no error") << file;
  }
  EXPECT_EQ(std::filesystem::file_size(path("precious")), 8u);
  EXPECT_EQ(record("new.mcap", path("own")), "no error");
  EXPECT_EQ(std::filesystem::status(path("own/new.mcap")).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(play("new.mcap", path("own")), "no error");

  std::filesystem::permissions(path("own"), std::filesystem::perms::all);
  EXPECT_THAT(record("newer.mcap", path("own")), HasSubstr("every user of this machine"));
}

// As another process may announce them: its names need not be ROS 2's.
class Announcing : public Outside {
 public:
  Graph graph() override {
    Graph graph;
    for (const char* name : {"/1abc", "/a//b", "/a/", "/", "/ev\\u001bil", "/sound", "/a b"}) {
      graph.publishers.push_back({.name = name, .type = "std_msgs/msg/String"});
    }
    return graph;
  }
};

// A publisher of the DDS topic rt/1abc ended each container with a recorder of all topics.
TEST_F(RecordingTest, ANameThatRos2LacksIsLeftOut) {
  Lines lines;
  NodeOptions outside = options({{"file", path("a")}});
  outside.participant = std::make_shared<Announcing>();
  {
    const auto recorder = std::make_shared<Recorder>(outside);
    executor_->add_node(recorder);
    run(1s);
    EXPECT_EQ(recorder->topic_count(), 1u);
    executor_->remove_node(recorder);
  }
  EXPECT_THAT(
      lines.get(),
      testing::Contains(HasSubstr("/1abc is not recorded: '/1abc' cannot be the name of a topic")));
  EXPECT_THAT(McapReader(path("a")).topics(), testing::IsEmpty());  // it has no message
}

// Four buffers of the largest size were 4 GB, and nothing kept a request from asking for more.
TEST_F(RecordingTest, TheBuffersHaveABound) {
  EXPECT_THAT([&] { McapWriter writer(path("a"), std::size_t{1} << 30, std::size_t{1} << 30); },
              ThrowsMessage<Error>(HasSubstr("are more than 1000 MB")));
}

// Chunks in chunks, a hundred thousand deep, ended the reader by a stack overflow.
TEST_F(RecordingTest, AChunkInAChunkIsRefused) {
  std::string chunks;
  for (std::uint64_t levels = 100'000; levels-- > 0;) {
    constexpr std::size_t kHead = 8 + 8 + 8 + 4 + 4 + 8;
    std::string head(1 + 8 + kHead, '\0');
    const std::uint64_t inside = levels * head.size(), content = kHead + inside;
    head[0] = 6;
    std::memcpy(head.data() + 1, &content, sizeof content);
    std::memcpy(head.data() + head.size() - sizeof inside, &inside, sizeof inside);
    chunks += head;
  }
  std::ofstream(path("a"), std::ios::binary) << "\x89MCAP0\r\n" << chunks;
  EXPECT_THAT([&] { McapReader reader(path("a")); },
              ThrowsMessage<Error>(HasSubstr("a chunk contains another chunk")));
}

// It was mapped into memory: reading what is not there any more ended the process by SIGBUS.
TEST_F(RecordingTest, AFileThatBecomesShorterWhileItIsPlayedIsAnError) {
  {
    McapWriter writer(path("a"), 1 << 20, 2);
    const std::size_t chatter = writer.add({"/chatter", "std_msgs/msg/String", ""});
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(eventually(
          [&] { return writer.write(chatter, i, i, encoded(std::string(10'000, 'x'))); }));
    }
  }
  const auto player = std::make_shared<Player>(options({{"file", path("a")}}));
  EXPECT_NE(dynamic_cast<const SetsReleases*>(player.get()), nullptr);  // for its analysis
  executor_->add_node(player);
  std::filesystem::resize_file(path("a"), 40'960);
  EXPECT_THAT([&] { run(1s); },
              ThrowsMessage<Error>(HasSubstr("the recording was truncated during reading")));
  executor_->remove_node(player);
}

TEST_F(RecordingTest, RecordsByPointerAndPlaysByteForByte) {
  const auto node = std::make_shared<Node>("talker", NodeOptions{.clock = &clock_});
  const auto early = node->create_publisher<std_msgs::msg::String>("early", 10, {.loans = 4});
  auto recorder = std::make_shared<Recorder>(options({{"file", path("a")}}));
  executor_->add_node(recorder);
  const auto late = node->create_publisher<std_msgs::msg::String>("late", 10, {.loans = 4});
  early->publish(std_msgs::msg::String().set__data("1"));
  run(300ms);  // finds what has come later
  late->publish(std_msgs::msg::String().set__data("2"));
  early->publish(std_msgs::msg::String().set__data("3"));
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

// It did not start at all.
TEST_F(RecordingTest, WithoutIoUringAThreadWrites) {
  const Lines lines;
  bool is_refused = false;
  std::unique_ptr<McapWriter> writer;
  std::shared_ptr<Recorder> recorder;
  std::thread([&] {
    is_refused = refuse_io_uring();
    writer = std::make_unique<McapWriter>(path("a"), 4096, 2);
    recorder = std::make_shared<Recorder>(options({{"file", path("b")}}));
  }).join();
  if (!is_refused) GTEST_SKIP() << "seccomp is not permitted";
  EXPECT_THAT(writer->why_no_ring(), HasSubstr("io_uring: Operation not permitted"));
  const std::size_t chatter = writer->add({"/chatter", "std_msgs/msg/String", ""});
  std::vector<std::string> written;
  for (int i = 0; i < 1000; ++i) {
    written.push_back(fmt::format("/chatter message {}", i));
    ASSERT_TRUE(eventually(
        [&] { return writer->write(chatter, i, i, encoded(written.back().substr(9))); }));
  }
  EXPECT_TRUE(writer->close());
  EXPECT_EQ(recorded("a"), written);
  recorder.reset();
  EXPECT_THAT(lines.get(), testing::Contains(HasSubstr("a thread writes it")).Times(1));
}

class FullDisk : public RecordingTest, public testing::WithParamInterface<bool> {};

// It was reported as "Success", because what was tried to complete the file had succeeded.
TEST_P(FullDisk, EndsTheRecordingAndIsCounted) {
  const Lines lines;
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{200'000, before.rlim_max};
  const auto node = std::make_shared<Node>("talker", NodeOptions{.clock = &clock_});
  const auto publisher = node->create_publisher<std_msgs::msg::String>("chatter", 10, {.loans = 4});
  std::shared_ptr<Recorder> recorder;
  std::thread([&] {
    if (!GetParam()) refuse_io_uring();
    recorder =
        std::make_shared<Recorder>(options({{"file", path("a")},
                                            {"buffer_bytes", 32768},
                                            {"topics", std::vector<std::string>{"chatter"}}}));
  }).join();
  executor_->add_node(recorder);
  setrlimit(RLIMIT_FSIZE, &small);
  std::uint64_t sent = 0;
  while (!recorder->has_ended() && sent < 1'000'000) {
    publisher->publish(std_msgs::msg::String().set__data(std::string(1000, 'x')));
    ++sent;
    run(1ms);
  }
  EXPECT_TRUE(recorder->has_ended());
  executor_->remove_node(recorder);
  const std::string failure = recorder->complete();
  recorder.reset();
  setrlimit(RLIMIT_FSIZE, &before);
  McapReader reader(path("a"));
  EXPECT_TRUE(reader.is_complete());
  EXPECT_GT(reader.messages().size(), 30u);
  EXPECT_LT(reader.messages().size(), 200u);  // 200 kB of 1 kB each
  const std::size_t lost = sent - reader.messages().size();
  EXPECT_EQ(failure, fmt::format("{} {} not recorded: File too large", counted(lost, "message"),
                                 lost == 1 ? "was" : "were"));
  EXPECT_THAT(lines.get(), testing::Contains(HasSubstr("File too large; recording stopped")));
  EXPECT_THAT(
      lines.get(),
      testing::Contains(HasSubstr(fmt::format(
          "{} of 1 topic, {} dropped", counted(reader.messages().size(), "message"), lost))));
}

// Nothing is written before the end, and so nothing is known of it.
TEST_P(FullDisk, IsReportedAtTheEndWhenThatIsTheFirstWrite) {
  const Lines lines;
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{1000, before.rlim_max};
  const auto node = std::make_shared<Node>("talker", NodeOptions{.clock = &clock_});
  const auto publisher = node->create_publisher<std_msgs::msg::String>("chatter", 10, {.loans = 4});
  std::shared_ptr<Recorder> recorder;
  std::thread([&] {
    if (!GetParam()) refuse_io_uring();
    recorder = std::make_shared<Recorder>(options({{"file", path("a")}}));
  }).join();
  executor_->add_node(recorder);
  publisher->publish(std_msgs::msg::String().set__data(std::string(2000, 'x')));
  run(1ms);
  EXPECT_EQ(recorder->recorded(), 1u);
  executor_->remove_node(recorder);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_EQ(recorder->complete(), "1 message was not recorded: File too large");
  setrlimit(RLIMIT_FSIZE, &before);
  recorder.reset();
  EXPECT_THAT(lines.get(), testing::Contains(HasSubstr("File too large; recording stopped")));
}

INSTANTIATE_TEST_SUITE_P(By, FullDisk, testing::Bool(),
                         [](const auto& by) { return by.param ? "IoUring" : "Thread"; });

}  // namespace
}  // namespace takt
