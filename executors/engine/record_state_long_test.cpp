// Runs the life of a record through all interleavings of a few threads, and all transitions that
// its table has not.
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "takt/testing/explorer.hpp"

#define takt takt_explored
#include "takt/executors/engine/record_state.hpp"
#undef takt

namespace takt_explored {
namespace {

using detail::RecordState;

// ---- The table ----

struct Record {
  RecordState state;
  RecordState::Mark mark{false};
  bool settle(bool more) {
    return state.settle(mark, more, 1, [] { return false; });
  }
};
// Each transition that expects a state, and the state that it leads to.
struct Transition {
  const char* name;
  RecordState::State from, to;
  void (*run)(Record&);
};
const Transition kTransitions[] = {
    {"park", RecordState::ready, RecordState::parked, [](Record& r) { r.state.park(); }},
    {"unpark", RecordState::parked, RecordState::ready, [](Record& r) { r.state.unpark(); }},
    {"begin", RecordState::ready, RecordState::running, [](Record& r) { r.state.begin(); }},
    {"settle", RecordState::running, RecordState::idle, [](Record& r) { r.settle(false); }},
    {"settle with more", RecordState::running, RecordState::ready,
     [](Record& r) { r.settle(true); }},
};
constexpr RecordState::State kStates[] = {RecordState::idle, RecordState::ready,
                                          RecordState::parked, RecordState::running};

void bring(Record& record, RecordState::State to) {
  if (to != RecordState::idle) record.state.make_ready(record.mark);
  if (to == RecordState::parked) record.state.park();
  if (to == RecordState::running) record.state.begin();
  ASSERT_EQ(record.state.state(), to);
}

TEST(RecordState, FollowsItsTableAndRefusesAllElse) {
  GTEST_FLAG_SET(death_test_style, "fast");
  for (const RecordState::State from : kStates) {
    for (const Transition& transition : kTransitions) {
      Record record;
      bring(record, from);
      if (from == transition.from) {
        transition.run(record);
        EXPECT_EQ(record.state.state(), transition.to) << transition.name;
      } else {
        EXPECT_DEATH(transition.run(record), "") << transition.name << " from " << from;
      }
    }
  }
}

TEST(RecordState, BecomesReadyOnlyWhileItIsIdleAndNotInTheInbox) {
  for (const RecordState::State from : kStates) {
    const bool is_idle = from == RecordState::idle;
    Record found, announced;
    bring(found, from);
    bring(announced, from);
    EXPECT_EQ(found.state.make_ready(found.mark), is_idle) << from;
    EXPECT_EQ(found.state.state(), is_idle ? RecordState::ready : from);
    EXPECT_TRUE(RecordState::announce(announced.mark));
    EXPECT_FALSE(RecordState::announce(announced.mark));
    EXPECT_FALSE(announced.state.make_ready(announced.mark)) << from;
    EXPECT_EQ(announced.state.drain(), is_idle) << from;
    EXPECT_EQ(announced.state.state(), is_idle ? RecordState::ready : from);
    EXPECT_FALSE(RecordState::announce(announced.mark)) << "it is not answered yet";
  }
}

TEST(RecordState, RunsAgainAfterAnAnnouncementOfTheWorkerWhileItRuns) {
  Record record;
  bring(record, RecordState::running);
  EXPECT_FALSE(record.state.make_ready(record.mark));
  EXPECT_TRUE(record.settle(false));
  record.state.begin();
  EXPECT_FALSE(record.settle(false));
}

TEST(RecordState, ChangesNoMoreOnceItIsRemoved) {
  for (const RecordState::State from : kStates) {
    Record record;
    bring(record, from);
    record.state.remove(record.mark);
    EXPECT_FALSE(RecordState::announce(record.mark));
    EXPECT_FALSE(record.state.make_ready(record.mark));
    EXPECT_EQ(record.state.state(), from);
    EXPECT_EQ(record.state.is_over(), from != RecordState::running);
    for (const Transition& transition : kTransitions) {
      EXPECT_DEATH(transition.run(record), "") << transition.name << " from " << from;
    }
  }
}

// ---- Threads ----

// A record with its publishers, workers, and threads that remove it, as the engine moves it. Its
// messages are a number, its scheduler and its inbox have one place each.
class Life {
 public:
  Life(int messages, int own, bool is_reentrant)
      : expected_(messages + own), is_reentrant_(is_reentrant), own_(own) {
    record_.retain();  // by the ready set
  }

  void publish() {
    level_.fetch_add(1);
    if (!RecordState::announce(mark_)) return;
    expect(!has_left_, "it was announced after it was given back");
    expect(inbox_.exchange(1) == 0, "it was in the inbox twice");
    signal();
  }

  void work(int rounds) {
    for (int i = 0; i < rounds; ++i) work();
  }
  void work_until_removed() {
    while (!has_left_) {
      const int seen = signals_.load();
      if (!work() && !has_left_) signals_.wait(seen);
    }
  }

  // As two threads do that remove a callback at the same time: one has claimed it.
  void claim(int removers) {
    for (int i = 0; i < removers; ++i) record_.retain();
    record_.release();  // it has left the list of callbacks
  }
  void remove(bool is_first) {
    if (is_first) {
      update_.store(1);
      signal();
    }
    for (int seen = signals_.load(); !record_.is_over(); seen = signals_.load())
      signals_.wait(seen);
    expect(running_ == 0, "an execution was left");
    if (record_.begin_to_detach()) {
      expect(++detached_ == 1, "two threads detached it");
      record_.set_detached();
    } else {
      record_.wait_until_detached();
    }
    expect(detached_ == 1, "it was not detached");
    record_.release();
  }

  std::string check(bool is_removed) {
    for (int i = 0; i < 2 * expected_ + 4; ++i) round();
    expect(inbox_.peek() == 0 && scheduled_ == 0, "the worker does not come to an end");
    if (is_removed) {
      expect(record_.is_unused(), "it is never freed");
      expect(record_.is_over() && record_.is_detached(), "it was not removed");
    } else {
      expect(level_.peek() == 0 && taken_ == expected_, "a message was left");
      expect(record_.state() == RecordState::idle && !record_.is_executing(), "it is not idle");
    }
    return wrong_;
  }

 private:
  void expect(bool holds, const char* otherwise) {
    if (!holds && wrong_.empty()) wrong_ = otherwise;
  }
  // A control thread may free it from here on.
  void release_by_ready_set() {
    record_.release();
    expect(!std::exchange(has_left_, true), "the ready set has given it back twice");
  }
  void schedule() { expect(std::exchange(scheduled_, 1) == 0, "it was scheduled twice"); }
  void leave() {
    if (!record_.is_over()) return;
    signal();
    if (!record_.has_left()) return;
    release_by_ready_set();
    signal();
  }

  bool work() {
    lock();
    const bool has_worked = round();
    unlock();
    return has_worked;
  }
  // At a dispatch point. False: there was nothing to do.
  bool round() {
    bool has_worked = false;
    if (update_.exchange(0) != 0) {
      record_.remove(mark_);
      scheduled_ = 0;
      leave();
      has_worked = true;
    }
    if (inbox_.exchange(0) != 0) {
      if (record_.is_removed()) {
        record_.discard();
        leave();
      } else if (record_.drain()) {
        schedule();
      }
      has_worked = true;
    }
    if (std::exchange(scheduled_, 0) == 0) return has_worked;
    record_.begin();
    expect(++running_ == 1 || is_reentrant_, "two executions at a time");
    unlock();
    const bool more = take();
    lock();
    if (own_ > 0) {  // its callback announces it, on the worker
      --own_;
      level_.fetch_add(1);
      if (record_.make_ready(mark_)) schedule();
    }
    if (is_reentrant_) {
      if (!record_.is_removed()) settle(more, 0);
      unlock();
      lock();
    }
    --running_;
    if (record_.is_removed()) {
      record_.end_execution();
      leave();
    } else if (is_reentrant_) {
      record_.end_execution();
    } else {
      settle(more, 1);
    }
    return true;
  }
  bool take() {
    int level = level_.load();
    while (level != 0 && !level_.compare_exchange_weak(level, level - 1)) {
    }
    if (level != 0) ++taken_;
    return level > 1;
  }
  void settle(bool more, std::uint32_t ended) {
    if (record_.settle(mark_, more, ended, [&] { return level_.load() != 0; })) schedule();
  }
  void signal() {
    signals_.fetch_add(1);
    signals_.notify_all();
  }
  void lock() {
    while (locked_.exchange(1) != 0) Explorer::yield();
  }
  void unlock() { locked_.store(0); }

  RecordState record_;
  RecordState::Mark mark_{false};
  std::atomic<int> level_{0}, inbox_{0}, update_{0}, locked_{0}, signals_{0};
  const int expected_;
  const bool is_reentrant_;
  int own_;  // messages that its callback sends to itself
  int scheduled_ = 0, running_ = 0, taken_ = 0, detached_ = 0;
  bool has_left_ = false;
  std::string wrong_;
};

struct Scenario {
  int publishers, workers;
  int rounds = 0;  // of each worker, if nobody removes it
  int removers = 0;
  int preemptions;
  bool is_reentrant = false;
  int own = 0;
};

void explore(const Scenario& scenario) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  std::unique_ptr<Life> life;
  std::map<std::string, int> wrong;
  Explorer explorer;
  const std::size_t schedules = explorer.explore(
      scenario.preemptions,
      [&] {
        life = std::make_unique<Life>(scenario.publishers, scenario.own, scenario.is_reentrant);
        if (scenario.removers != 0) life->claim(scenario.removers);
        Explorer::Bodies bodies;
        for (int i = 0; i < scenario.publishers; ++i) {
          bodies.emplace_back([&] { life->publish(); });
        }
        for (int i = 0; i < scenario.workers; ++i) {
          bodies.emplace_back([&] {
            scenario.removers == 0 ? life->work(scenario.rounds) : life->work_until_removed();
          });
        }
        for (int i = 0; i < scenario.removers; ++i) {
          bodies.emplace_back([&, i] { life->remove(i == 0); });
        }
        return bodies;
      },
      [&] {
        if (explorer.stuck() != 0) return void(++wrong["a thread waits for ever"]);
        if (const std::string why = life->check(scenario.removers != 0); !why.empty()) ++wrong[why];
      });
  for (const auto& [why, count] : wrong) {
    ADD_FAILURE() << why << ": " << count << " of " << schedules << " schedules";
  }
  ::testing::Test::RecordProperty("schedules", static_cast<int>(schedules));
}

TEST(RecordStateInterleavings, LosesNoMessage) {
  explore({.publishers = 2, .workers = 1, .rounds = 3, .preemptions = 3});
}
TEST(RecordStateInterleavings, LosesNoMessageThatTheCallbackSendsToItself) {
  explore({.publishers = 1, .workers = 2, .rounds = 2, .preemptions = 2, .own = 1});
}
TEST(RecordStateInterleavings, LosesNoMessageBetweenTwoWorkers) {
  explore({.publishers = 2, .workers = 2, .rounds = 2, .preemptions = 2});
}
TEST(RecordStateInterleavings, LosesNoMessageOfAReentrantGroup) {
  explore({.publishers = 2, .workers = 2, .rounds = 2, .preemptions = 2, .is_reentrant = true});
}
TEST(RecordStateInterleavings, IsFreedOnceWhenItIsRemoved) {
  explore({.publishers = 1, .workers = 1, .removers = 2, .preemptions = 2});
}
TEST(RecordStateInterleavings, IsFreedOnceWhenAReentrantOneIsRemoved) {
  explore({.publishers = 1, .workers = 2, .removers = 1, .preemptions = 1, .is_reentrant = true});
}

}  // namespace
}  // namespace takt_explored
