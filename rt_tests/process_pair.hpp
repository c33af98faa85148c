// Measures messages from a publisher in a child process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RT_TESTS_PROCESS_PAIR_HPP_
#define TAKT_RT_TESTS_PROCESS_PAIR_HPP_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <sys/types.h>

#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt::rt {

struct Stamp {
  std::int64_t sent_ns = 0;
  std::vector<std::uint8_t> payload;
};
TAKT_MESSAGE(Stamp, "rt_tests/msg/Stamp", sent_ns, payload);

/// A node that publishes every 500 µs and a node that subscribes, with separate executors or a
/// common one.
class Pair {
 public:
  Pair(std::shared_ptr<Participant> participant, std::size_t payload_bytes);
  void talk(Executor& executor);
  /// Cancels the executor after this many messages.
  void listen(Executor& executor, std::uint64_t messages);

  Histogram latency;  // from publish to the start of the callback
  std::shared_ptr<Publisher<Stamp>> publisher;

 private:
  std::shared_ptr<Node> talker_, listener_;
  std::shared_ptr<Subscription<Stamp>> subscription_;
  std::shared_ptr<Timer> timer_;
  Stamp stamp_;
};

/// `events` on one thread.
std::unique_ptr<Executor> executor_on(const ThreadAttributes& thread);

/// Construct it before this process has threads. The listener runs in this process under SCHED_FIFO
/// 80, the talker in the child under 70. Both join the domain with these options.
class ProcessPair {
 public:
  explicit ProcessPair(const DdsOptions& dds, std::size_t payload_bytes = 0);
  ~ProcessPair();
  ProcessPair(const ProcessPair&) = delete;
  ProcessPair& operator=(const ProcessPair&) = delete;

  Histogram run(std::uint64_t messages);

 private:
  const DdsOptions dds_;
  const std::size_t payload_bytes_;
  std::array<int, 2> pipe_{};  // each byte starts a round
  pid_t child_ = 0;
  std::shared_ptr<Participant> participant_;  // made by the first round
};

}  // namespace takt::rt

#endif  // TAKT_RT_TESTS_PROCESS_PAIR_HPP_
