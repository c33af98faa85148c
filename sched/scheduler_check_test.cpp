// Tests of the check of schedulers, by schedulers that are broken, each in one way.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler_check.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"
#include "takt/testing/proves.hpp"

namespace takt {
namespace {

// Last come, first served: sound, and short enough to be broken in many ways.
class Stack : public Scheduler {
 public:
  void push(ReadyCallback& callback) noexcept override {
    callback.next = top_;
    top_ = &callback;
  }
  ReadyCallback* pop() noexcept override {
    ReadyCallback* callback = top_;
    if (callback != nullptr) top_ = callback->next;
    return callback;
  }

 protected:
  ReadyCallback* top_ = nullptr;
};

template <class Broken>
std::string error_of() {
  try {
    check_scheduler("mine", [] { return std::make_unique<Broken>(); });
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SchedulerCheck, AcceptsWhatIsSound) {
  EXPECT_EQ(error_of<Stack>(), "no error");
}

// `takt check` was silent for ever.
TEST(SchedulerCheck, GivesUpOnWhatDoesNotReturn) {
  static std::atomic<bool> may_return{false};
  struct Hangs : Stack {
    ReadyCallback* pop() noexcept override {
      may_return.wait(false);
      return nullptr;
    }
  };
  std::string error;
  try {
    check_scheduler(
        "mine", [] { return std::make_unique<Hangs>(); }, std::chrono::milliseconds(50));
  } catch (const Error& given_up) {
    error = given_up.what();
  }
  EXPECT_EQ(error,
            "scheduler 'mine' has not returned for 50ms; let each of its functions return, also "
            "without a callback that waits");
  may_return.store(true);
  may_return.notify_all();
}

TEST(SchedulerCheck, FindsWhatIsNeverReturned) {
  struct Loses : Stack {  // what is pushed while another waits
    void push(ReadyCallback& callback) noexcept override {
      if (top_ == nullptr) Stack::push(callback);
    }
  };
  proves("configuration.md",
         "if it loses, repeats or invents callbacks, or throws, this is an error");
  EXPECT_EQ(error_of<Loses>(),
            "scheduler 'mine' pops nothing, and 9 of 10 callbacks wait; return every callback once "
            "for each push");
}

TEST(SchedulerCheck, FindsWhoPopsNothingAlthoughSomethingWaits) {
  struct Hesitates : Stack {
    ReadyCallback* pop() noexcept override { return ++pops % 7 == 0 ? nullptr : Stack::pop(); }
    int pops = 0;
  };
  EXPECT_EQ(error_of<Hesitates>(),
            "scheduler 'mine' pops nothing, and 1 of 1 callbacks wait; return every callback once "
            "for each push");
}

TEST(SchedulerCheck, FindsWhoPopsWhenNothingWaits) {
  struct Remembers : Stack {
    ReadyCallback* pop() noexcept override { return top_; }
  };
  EXPECT_EQ(error_of<Remembers>(),
            "scheduler 'mine' pops a callback when none waits; return every callback once for each "
            "push");
}

TEST(SchedulerCheck, FindsWhatIsReturnedTwice) {
  struct Repeats : Stack {
    ReadyCallback* pop() noexcept override {
      if (top_ == nullptr || top_->next == nullptr) return Stack::pop();
      return repeats_ ? (repeats_ = false, Stack::pop()) : (repeats_ = true, top_);
    }
    bool repeats_ = false;
  };
  EXPECT_EQ(error_of<Repeats>(),
            "scheduler 'mine' pops a callback twice; return every callback once for each push");
}

TEST(SchedulerCheck, FindsWhatWasNeverGiven) {
  struct Copies : Stack {
    ReadyCallback* pop() noexcept override {
      const ReadyCallback* callback = Stack::pop();
      return callback == nullptr ? nullptr : &(copy_ = *callback);
    }
    ReadyCallback copy_;
  };
  EXPECT_EQ(error_of<Copies>(),
            "scheduler 'mine' pops a callback that it was never given; return the one that was "
            "pushed, no copy");
}

TEST(SchedulerCheck, FindsWhoThrows) {
  struct NeverMade : Stack {
    NeverMade() { throw std::runtime_error("no such day"); }
  };
  EXPECT_EQ(error_of<NeverMade>(),
            "scheduler 'mine' throws in its constructor: no such day; let it be made whenever an "
            "executor needs one");
  struct NeverConfigured : Stack {
    void configure(std::span<const CallbackInfo> callbacks) override {
      if (callbacks.size() > 20) throw std::runtime_error("too many");
    }
  };
  EXPECT_EQ(error_of<NeverConfigured>(),
            "scheduler 'mine' throws in configure: too many; take what it is given");
}

TEST(SchedulerCheck, FindsWhoAllocates) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  struct Allocates : Stack {
    void done(const ReadyCallback&, Nanoseconds) noexcept override {
      ::operator delete(::operator new(1));
    }
  };
  EXPECT_THAT(error_of<Allocates>(),
              testing::StartsWith("scheduler 'mine' allocates memory after configure, "));
}

// A place in a group's parking knows only the callbacks of that group, and their ids have gaps.
TEST(SchedulerCheck, FindsWhoTakesIdsForPositions) {
  struct ById : Scheduler {
    void configure(std::span<const CallbackInfo> callbacks) override {
      waiting_.resize(callbacks.size());
    }
    void push(ReadyCallback& callback) noexcept override {
      if (callback.info->id < waiting_.size()) waiting_[callback.info->id] = &callback;
    }
    ReadyCallback* pop() noexcept override {
      for (ReadyCallback*& callback : waiting_) {
        if (callback != nullptr) return std::exchange(callback, nullptr);
      }
      return nullptr;
    }
    std::vector<ReadyCallback*> waiting_;
  };
  EXPECT_THAT(error_of<ById>(), testing::HasSubstr("pops nothing"));
}

}  // namespace
}  // namespace takt
