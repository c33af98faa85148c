// Tests of read sections and of waiting for them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/read_section.hpp"

#include <atomic>
#include <fstream>
#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/realtime_scope.hpp"
#include "takt/testing/eventually.hpp"

namespace takt {
namespace {

long voluntary_switches(long tid) {
  std::ifstream status("/proc/self/task/" + std::to_string(tid) + "/status");
  const std::string wanted = "voluntary_ctxt_switches:";
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(wanted)) return std::stol(line.substr(wanted.size()));
  }
  return -1;
}

// A thread that waits for readers.
class Writer {
 public:
  Writer()
      : thread_([this] {
          tid_.store(syscall(SYS_gettid));
          tid_.notify_all();
          wait_for_readers();
          has_returned_.store(true);
          has_returned_.notify_all();
          gave_up_waiting_.wait();
        }) {}
  ~Writer() {
    gave_up_waiting_.count_down();
    thread_.join();
  }

  /// Returns when the writer has slept several times, which it only does for a section that it
  /// found open.
  void wait_until_it_naps() {
    tid_.wait(0);
    const long before = voluntary_switches(tid_);
    EXPECT_TRUE(eventually([&] { return voluntary_switches(tid_) >= before + 5; }));
  }
  void wait_until_it_returns() { has_returned_.wait(false); }
  bool has_returned() const { return has_returned_; }
  const std::atomic<bool>& returned() const { return has_returned_; }

 private:
  std::atomic<long> tid_{0};
  std::atomic<bool> has_returned_{false};
  std::latch gave_up_waiting_{1};  // keeps the thread, so that its counters can be read
  std::thread thread_;
};

class ReadSectionTest : public testing::Test {
 protected:
  void SetUp() override {
    if (voluntary_switches(syscall(SYS_gettid)) < 0) GTEST_SKIP() << "/proc cannot be read";
  }
  std::latch opened_{1}, close_{1};
};

TEST_F(ReadSectionTest, IsWaitedForUntilItCloses) {
  int written_inside = 0;  // not atomic: the end of the wait must come after it
  std::thread reader([&] {
    const ReadSection section;
    opened_.count_down();
    close_.wait();
    written_inside = 1;
  });
  opened_.wait();
  {
    Writer writer;
    writer.wait_until_it_naps();
    EXPECT_FALSE(writer.has_returned());
    close_.count_down();
    writer.wait_until_it_returns();
    EXPECT_EQ(written_inside, 1);
  }
  reader.join();
}

TEST_F(ReadSectionTest, IsOpenUntilTheOutermostCloses) {
  std::thread reader([&] {
    const ReadSection outer;
    { const ReadSection inner; }
    opened_.count_down();
    close_.wait();
  });
  opened_.wait();
  Writer writer;
  writer.wait_until_it_naps();
  EXPECT_FALSE(writer.has_returned());
  close_.count_down();
  writer.wait_until_it_returns();
  reader.join();
}

TEST_F(ReadSectionTest, OpenedAfterTheCallIsNotWaitedFor) {
  std::atomic<const std::atomic<bool>*> writer_returned{nullptr};
  std::thread reader([&] {
    {
      const ReadSection first;
      opened_.count_down();
      close_.wait();
    }
    const ReadSection second;
    writer_returned.load()->wait(false);
  });
  opened_.wait();
  {
    Writer writer;
    writer_returned.store(&writer.returned());
    writer.wait_until_it_naps();
    close_.count_down();
    writer.wait_until_it_returns();  // with the second section open, or this test hangs
    EXPECT_TRUE(writer.has_returned());
    reader.join();
  }
}

TEST_F(ReadSectionTest, HoldsUpNobodyWhenClosedOrItsThreadHasEnded) {
  { const ReadSection closed; }
  std::thread([] { const ReadSection ended; }).join();
  const RealtimeScope scope;
  wait_for_readers();
  if (allocations_are_counted()) {
    EXPECT_EQ(scope.so_far().allocations, 0u);
  }
}

TEST_F(ReadSectionTest, AllocatesNothingAfterTheFirstOfItsThread) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  { const ReadSection first; }
  const RealtimeScope scope;
  for (int i = 0; i < 10; ++i) {
    const ReadSection outer;
    const ReadSection inner;
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

// What it is for. A reader that met a freed table would be seen by the sanitizers, and by the
// number that a table loses when it is destroyed. Threads come and go, so that records are reused.
TEST_F(ReadSectionTest, KeepsATableAliveThatIsReplacedMeanwhile) {
  struct Table {
    ~Table() { alive = 0; }
    volatile int alive = 1;
  };
  std::atomic<const Table*> current{new Table};
  std::atomic<bool> stop{false};
  std::atomic<int> dead_tables_seen{0};
  const auto read = [&] {
    while (!stop.load()) {
      for (int i = 0; i < 50; ++i) {
        const ReadSection section;
        if (current.load()->alive != 1) dead_tables_seen.fetch_add(1);
      }
      std::thread([&] {
        const ReadSection section;
        if (current.load()->alive != 1) dead_tables_seen.fetch_add(1);
      }).join();
    }
  };
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) readers.emplace_back(read);
  for (int i = 0; i < 500; ++i) {
    const std::unique_ptr<const Table> old(current.exchange(new Table));
    wait_for_readers();
  }
  stop.store(true);
  for (std::thread& reader : readers) reader.join();
  delete current.load();
  EXPECT_EQ(dead_tables_seen, 0);
}

}  // namespace
}  // namespace takt
