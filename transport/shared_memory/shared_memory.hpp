// RouDi, the process that gives out iceoryx's shared memory: whether we can use the one that runs,
// and starting one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_SHARED_MEMORY_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_SHARED_MEMORY_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <sys/types.h>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Whether messages of fixed size go to other processes by shared memory.
enum class SharedMemory {
  automatic,  // when a RouDi runs that we can use; else, and for all other messages, UDP
  require,    // an Error when they cannot
  off,
};

/// The RouDi of this machine, of which there is one at most.
struct Roudi {
  std::string unusable;             // why we cannot use it; empty: we can
  std::size_t largest_message = 0;  // in bytes, of what its largest pool can take
  std::uint64_t identity = 0;       // another number when it was started again
  pid_t pid = 0;
  bool is_silent = false;  // it runs and does not answer
};

/// Looks at its lock, its socket and the configuration that it was started with, and asks whether
/// it answers: a client would wait for ever for one that does not. Thread safety: from any thread.
/// Real-time: set-up only, it reads files, and waits 1.5 s for an answer.
Roudi find_roudi();

/// What lies in /dev/shm: the most that iceoryx maps.
std::size_t shared_memory_bytes() noexcept;

/// Memory for messages of a size, and for smaller ones that have no pool of their own.
struct ChunkPool {
  std::size_t message_bytes = 0;
  std::size_t chunks = 0;
};

// Limit: messages of a subscription that wait in shared memory. At it: the oldest is overwritten.
// Seen: `lost` of the topic.
inline constexpr std::size_t kMostQueued = 256;  // iceoryx's limit

/// What a publisher can have in use at once: eight loans, and the message that it sent last.
inline constexpr std::size_t kChunksOfWriter = 9;
/// The same for a subscription: what waits in iceoryx's queue, and what its callbacks have.
std::size_t chunks_of_reader(std::size_t depth, std::size_t message_bytes) noexcept;

/// A RouDi that all `takt run` of a user share. It does not watch its clients: they survive being
/// stopped for seconds, and one that is killed gives nothing back before RouDi ends. It ends, and
/// its files with it, when the last process has gone that has one of these or is a child of one
/// that has, also by a signal.
/// Thread safety: for one thread. Make it before the process has other threads.
/// Real-time: no; set-up only.
class RoudiProcess {
 public:
  /// Starts one with these pools and waits until it serves, unless one runs already, ours or not.
  /// Throws Error when it does not start: it is not installed, or /dev/shm has no room.
  explicit RoudiProcess(const std::function<std::vector<ChunkPool>()>& pools);
  explicit RoudiProcess(std::vector<ChunkPool> pools) : RoudiProcess([&pools] { return pools; }) {}
  /// When it is the last, waits until RouDi has ended.
  ~RoudiProcess();
  RoudiProcess(const RoudiProcess&) = delete;
  RoudiProcess& operator=(const RoudiProcess&) = delete;

  pid_t pid() const noexcept { return pid_; }
  static bool is_installed();

 private:
  class LockFile;
  std::unique_ptr<LockFile> users_;
  pid_t pid_ = 0, keeper_ = 0;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_SHARED_MEMORY_HPP_
