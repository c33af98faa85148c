// Tests of callbacks for devices, pipes and sockets.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/file_descriptor.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Events = FileDescriptorEvents;

class CountingSink final : public Sink {
 public:
  void announce(const Arrival&) noexcept override { ++announcements; }
  void release_changed() noexcept override {}
  void remove() noexcept override {}
  void expect_remove() noexcept override {}
  int announcements = 0;
};

class FileDescriptorTest : public testing::Test {
 protected:
  FileDescriptorTest() { EXPECT_EQ(pipe2(ends_, O_NONBLOCK | O_CLOEXEC), 0); }
  ~FileDescriptorTest() override {
    close_end(0);
    close_end(1);
  }
  void close_end(int end) {
    if (ends_[end] >= 0) close(std::exchange(ends_[end], -1));
  }
  void send(const std::string& text) {
    ASSERT_EQ(write(ends_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  std::string receive(std::size_t most) {
    std::string text(most, ' ');
    const ssize_t size = read(ends_[0], text.data(), most);
    text.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return text;
  }
  FileDescriptor& make(int fd, Events events, std::function<void(Events)> callback = {}) {
    return entity_.emplace("pipe", group_, clock_, fd, events, std::move(callback));
  }
  // What the next take reports; none if there is nothing to take.
  Events taken() { return entity_->take(slot_) ? static_cast<Events>(slot_.events) : Events::none; }

  ManualClock clock_{TimePoint(1h)};
  std::shared_ptr<CallbackGroup> group_ =
      std::make_shared<CallbackGroup>("group", CallbackGroupType::MutuallyExclusive);
  int ends_[2] = {-1, -1};
  Slot slot_;
  CountingSink sink_;
  std::optional<FileDescriptor> entity_;
};

TEST_F(FileDescriptorTest, IsReadyForAsLongAsThereIsSomethingToRead) {
  make(ends_[0], Events::readable);
  EXPECT_EQ(entity_->kind(), EntityKind::waitable);
  EXPECT_EQ(entity_->ready_count(), 0u);
  EXPECT_EQ(taken(), Events::none);
  send("abc");
  EXPECT_EQ(entity_->ready_count(), 1u);
  EXPECT_EQ(taken(), Events::readable);
  EXPECT_EQ(receive(2), "ab");
  EXPECT_EQ(taken(), Events::readable);
  EXPECT_EQ(receive(2), "c");
  EXPECT_EQ(taken(), Events::none);
}

TEST_F(FileDescriptorTest, ReportsWhatItIsReadyFor) {
  make(ends_[1], Events::readable | Events::writable);
  EXPECT_EQ(taken(), Events::writable);
}

TEST_F(FileDescriptorTest, AnnouncesItselfAgainWhenTheCallbackHasLeftSomething) {
  make(ends_[0], Events::readable, [this](Events) { receive(2); });
  entity_->attach(sink_);
  send("abc");
  ASSERT_EQ(taken(), Events::readable);
  entity_->execute(slot_);
  EXPECT_EQ(sink_.announcements, 1);
  ASSERT_EQ(taken(), Events::readable);
  entity_->execute(slot_);
  EXPECT_EQ(sink_.announcements, 1);
  entity_->detach();
}

TEST_F(FileDescriptorTest, AnnouncesItselfAgainWhenTheCallbackHasThrown) {
  make(ends_[0], Events::readable, [](Events) { throw std::runtime_error("no"); });
  entity_->attach(sink_);
  send("abc");
  ASSERT_EQ(taken(), Events::readable);
  EXPECT_THROW(entity_->execute(slot_), std::runtime_error);
  EXPECT_EQ(sink_.announcements, 1);
  entity_->detach();
}

TEST_F(FileDescriptorTest, PassesOnEventsOfTheKernelThatStillHold) {
  make(ends_[0], Events::readable);
  entity_->attach(sink_);
  ArrivalListener& listener = *entity_->watch().listener;
  listener.announce({1, clock_.now()});  // stale: it was read meanwhile
  EXPECT_EQ(sink_.announcements, 0);
  send("abc");
  listener.announce({2, clock_.now()});
  EXPECT_EQ(sink_.announcements, 1);
  clock_.advance(1ms);
  ASSERT_EQ(taken(), Events::readable);
  EXPECT_EQ(slot_.ready_time, TimePoint(1h));
  entity_->detach();
}

// Else a callback that waits for the end would run for ever.
TEST_F(FileDescriptorTest, ReportsAHangUpOnceAndWhenAllIsRead) {
  make(ends_[0], Events::readable);
  send("abc");
  close_end(1);
  EXPECT_EQ(taken(), Events::readable);
  receive(3);
  EXPECT_EQ(taken(), Events::hang_up);
  EXPECT_EQ(entity_->ready_count(), 0u);
  EXPECT_EQ(taken(), Events::none);
}

// The end of a socket is readable for ever.
TEST_F(FileDescriptorTest, ReportsTheEndOfASocketOnce) {
  int sockets[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, sockets), 0);
  make(sockets[0], Events::readable);
  ASSERT_EQ(write(sockets[1], "abc", 3), 3);
  shutdown(sockets[1], SHUT_WR);
  EXPECT_EQ(taken(), Events::readable);
  char buffer[8];
  ASSERT_EQ(read(sockets[0], buffer, sizeof buffer), 3);
  EXPECT_EQ(taken(), Events::hang_up);
  EXPECT_EQ(taken(), Events::none);
  close(sockets[1]);
  EXPECT_EQ(taken(), Events::none);
  entity_.reset();
  close(sockets[0]);
}

// A pipe that nobody reads is writable for ever.
TEST_F(FileDescriptorTest, ReportsOnceToAWriterThatNobodyReads) {
  make(ends_[1], Events::writable);
  EXPECT_EQ(taken(), Events::writable);
  close_end(0);
  EXPECT_EQ(taken(), Events::error);
  EXPECT_EQ(taken(), Events::none);
}

TEST_F(FileDescriptorTest, ReportsAHangUpAgainAfterItWasReconnected) {
  const std::string path = testing::TempDir() + "takt_file_descriptor_test_fifo";
  unlink(path.c_str());
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const int reader = open(path.c_str(), O_RDONLY | O_NONBLOCK);
  make(reader, Events::readable);
  for (int round = 0; round < 2; ++round) {
    const int writer = open(path.c_str(), O_WRONLY | O_NONBLOCK);
    EXPECT_EQ(taken(), Events::none);
    close(writer);
    EXPECT_EQ(taken(), Events::hang_up);
    EXPECT_EQ(taken(), Events::none);
  }
  entity_.reset();
  close(reader);
  unlink(path.c_str());
}

TEST_F(FileDescriptorTest, LogsADescriptorThatWasClosedOnceAndServesItNoMore) {
  std::vector<std::string> lines;
  Logger::instance().flush();
  Logger::instance().set_writer([&](LogLevel, std::string_view line) { lines.emplace_back(line); });
  make(ends_[0], Events::readable);
  const int number = ends_[0];
  close_end(0);
  EXPECT_EQ(taken(), Events::none);
  EXPECT_EQ(taken(), Events::none);
  // Another file of the same number is none of ours.
  ASSERT_EQ(dup2(ends_[1], number), number);
  EXPECT_EQ(taken(), Events::none);
  close(number);
  Logger::instance().flush();
  Logger::instance().set_writer({});
  EXPECT_THAT(lines, ElementsAre(HasSubstr("was closed before the entity was dropped")));
}

TEST_F(FileDescriptorTest, DoesNotOverlapWithItselfInAReentrantGroup) {
  group_ = std::make_shared<CallbackGroup>("group", CallbackGroupType::Reentrant);
  bool was_taken_inside = true;
  make(ends_[0], Events::readable, [&](Events) {
    Slot other;
    was_taken_inside = entity_->take(other);
  });
  send("abc");
  ASSERT_EQ(taken(), Events::readable);
  entity_->execute(slot_);
  EXPECT_FALSE(was_taken_inside);
  EXPECT_EQ(taken(), Events::readable);
  entity_->execute(slot_);
}

TEST_F(FileDescriptorTest, RefusesWhatCannotBeWaitedFor) {
  const std::string path = testing::TempDir() + "takt_file_descriptor_test_file";
  const int file = open(path.c_str(), O_RDWR | O_CREAT, 0600);
  EXPECT_THAT([&] { make(file, Events::readable); },
              ThrowsMessage<Error>(HasSubstr("it is always ready, as regular files are")));
  close(file);
  unlink(path.c_str());
  EXPECT_THAT([&] { make(file, Events::readable); },
              ThrowsMessage<Error>(HasSubstr("Bad file descriptor; give one that is open")));
  EXPECT_THAT([&] { make(ends_[0], Events::none); },
              ThrowsMessage<Error>(HasSubstr("give `readable`, `writable` or both")));
  EXPECT_THROW(make(ends_[0], Events::readable | Events::hang_up), Error);
}

TEST_F(FileDescriptorTest, IsTakenAndExecutedWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  make(ends_[0], Events::readable, [](Events) {});
  { const ReadSection registers_this_thread; }
  entity_->attach(sink_);
  send("abc");
  const RealtimeScope scope;
  entity_->watch().listener->announce({1, clock_.now()});
  const bool is_taken = entity_->take(slot_);
  entity_->execute(slot_);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(is_taken);
  EXPECT_EQ(sink_.announcements, 2);
  entity_->detach();
}

// An executor that takes all inputs of a period discards those that a callback has removed. In a
// reentrant group the entity then counted as executing, and was not taken again.
TEST_F(FileDescriptorTest, IsReadyAgainAfterWhatWasTakenIsDiscarded) {
  group_ = std::make_shared<CallbackGroup>("reentrant", CallbackGroupType::Reentrant);
  make(ends_[0], Events::readable);
  entity_->attach(sink_);
  send("abc");
  EXPECT_EQ(taken(), Events::readable);
  const int before = sink_.announcements;
  entity_->discard(slot_);
  EXPECT_EQ(sink_.announcements, before + 1);
  EXPECT_EQ(taken(), Events::readable);
  entity_->execute(slot_);
  entity_->detach();
}

}  // namespace
}  // namespace takt
