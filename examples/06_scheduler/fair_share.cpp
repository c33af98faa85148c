// The callback group that has used the least time runs next. A group that slept earns no credit.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"
using namespace takt;

struct FairShare : Scheduler {
  void configure(std::span<const CallbackInfo> infos) override {
    for (const auto& info : infos)
      used_.resize(std::max<std::size_t>(used_.size(), info.group + 1));
    waiting_.reserve(infos.size());
  }
  void push(ReadyCallback& callback) noexcept override {
    used(callback) = std::max(used(callback), served_);
    waiting_.push_back(&callback);
  }
  ReadyCallback* pop() noexcept override {
    if (waiting_.empty()) return nullptr;
    auto* next = *std::ranges::min_element(waiting_, {}, [&](auto* one) { return used(*one); });
    std::erase(waiting_, next);
    served_ = used(*next);
    return next;
  }
  void done(const ReadyCallback& one, Nanoseconds time) noexcept override { used(one) += time; }

  Nanoseconds& used(const ReadyCallback& one) { return used_[one.info->group]; }
  std::vector<Nanoseconds> used_;        // by group
  std::vector<ReadyCallback*> waiting_;  // as they came
  Nanoseconds served_{0};                // what the group that ran last had used
};
TAKT_REGISTER_SCHEDULER("fair_share", "the least used group first", FairShare, .takes_turns = false)
