// A scheduler that is unfair on purpose: the conformance suite runs it with every executor.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

// As a user would write it. It failed 14 tests, and no page said why.
class NewestFirst final : public Scheduler {
 public:
  void push(ReadyCallback& callback) noexcept override {
    callback.next = std::exchange(newest_, &callback);
  }
  ReadyCallback* pop() noexcept override {
    if (newest_ == nullptr) return nullptr;
    return std::exchange(newest_, newest_->next);
  }

 private:
  ReadyCallback* newest_ = nullptr;
};

TAKT_REGISTER_SCHEDULER("newest_first", "last in, first out", NewestFirst, .uses_time = false,
                        .takes_turns = false)

}  // namespace
}  // namespace takt
