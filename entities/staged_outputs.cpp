// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/staged_outputs.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "takt/base/never_destroyed.hpp"
#include "takt/entities/send.hpp"

namespace takt {
namespace {

/// All live StagedOutputs: a publisher that is destroyed removes its messages from them.
struct AllOutputs {
  RankedMutex<LockRank::all_outputs> mutex;
  std::vector<StagedOutputs*> all;
  std::atomic<std::size_t> count{0};
};
AllOutputs& all_outputs() noexcept {
  static detail::NeverDestroyed<AllOutputs> instance;
  return *instance;
}

}  // namespace

StagedOutputs::StagedOutputs(std::size_t capacity) : capacity_(capacity) {
  outputs_.reserve(capacity);
  const std::lock_guard lock(all_outputs().mutex);
  all_outputs().all.push_back(this);
  ++all_outputs().count;
}

StagedOutputs::~StagedOutputs() {
  {
    const std::lock_guard lock(all_outputs().mutex);
    std::erase(all_outputs().all, this);
    --all_outputs().count;
  }
  publish();
}

void StagedOutputs::add(IntraProcessWriter& writer, RemoteWriter* remote,
                        MessageBlock& message) noexcept {
  message.set_references(1);
  {
    const std::lock_guard lock(mutex_);
    if (outputs_.size() < capacity_) {
      outputs_.push_back({&writer, remote, &message});
      return;
    }
    ++dropped_;
  }
  message.release();
}

// With the mutex held, so that no publisher is destroyed meanwhile.
void StagedOutputs::publish() noexcept {
  ReleasedMessages released;
  const std::lock_guard lock(mutex_);
  for (const auto& [writer, remote, message] : outputs_) {
    const PublishTime now{writer->stamp(), remote != nullptr ? remote->stamp() : WallTime{}};
    send(*writer, remote, *message, now, released);
  }
  outputs_.clear();
}

std::size_t StagedOutputs::size() const noexcept {
  const std::lock_guard lock(mutex_);
  return outputs_.size();
}

std::uint64_t StagedOutputs::dropped() const noexcept {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

void StagedOutputs::forget(const IntraProcessWriter& writer) noexcept {
  if (all_outputs().count.load() == 0) return;
  ReleasedMessages released;
  const std::lock_guard lock(all_outputs().mutex);
  for (StagedOutputs* staged : all_outputs().all) {
    const std::lock_guard staged_lock(staged->mutex_);
    std::erase_if(staged->outputs_, [&](const Output& output) {
      if (output.writer != &writer) return false;
      released.release(*output.message);
      return true;
    });
  }
}

}  // namespace takt
