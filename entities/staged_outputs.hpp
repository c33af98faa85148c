// Messages that are held back until the end of a period.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_STAGED_OUTPUTS_HPP_
#define TAKT_ENTITIES_STAGED_OUTPUTS_HPP_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

/// Where publishers put their messages while a callback runs under logical execution time. They are
/// published together, in the order in which they came. When it is full, a message is dropped and
/// counted. What a publisher has here goes with it.
/// Thread safety: every method from any thread.
/// Real-time: add and publish allocate nothing, and lock with priority inheritance.
class StagedOutputs {
 public:
  explicit StagedOutputs(std::size_t capacity);
  ~StagedOutputs();
  StagedOutputs(const StagedOutputs&) = delete;
  StagedOutputs& operator=(const StagedOutputs&) = delete;

  /// Takes the caller's hold of the message over. `remote` may be nullptr.
  void add(IntraProcessWriter& writer, RemoteWriter* remote, MessageBlock& message) noexcept;
  void publish() noexcept;
  std::size_t size() const noexcept;
  std::uint64_t dropped() const noexcept;

  /// The writer's publisher goes: nothing is published with it any more.
  static void forget(const IntraProcessWriter& writer) noexcept;

 private:
  struct Output {
    IntraProcessWriter* writer;
    RemoteWriter* remote;
    MessageBlock* message;
  };

  const std::size_t capacity_;
  mutable RankedMutex<LockRank::outputs> mutex_;
  std::vector<Output> outputs_ TAKT_GUARDED_BY(mutex_);
  std::uint64_t dropped_ TAKT_GUARDED_BY(mutex_) = 0;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_STAGED_OUTPUTS_HPP_
