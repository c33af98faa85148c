// RouDi, the process that gives out iceoryx's shared memory: whether we can use the one that runs,
// and starting one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <sys/types.h>

namespace takt {

/// Whether messages of fixed size go to other processes by shared memory.
enum class SharedMemory {
  automatic,  // when a RouDi runs that we can use; else, and for all other messages, UDP
  require,    // an Error when they cannot
  off,
};

/// The RouDi of this machine, of which there is one at the most.
struct Roudi {
  std::string unusable;             // why we cannot use it; empty: we can
  std::size_t largest_message = 0;  // in bytes, of what its largest pool can take
  std::uint64_t identity = 0;       // another number when it was started again
  pid_t pid = 0;
};

/// Looks without asking it, as a question to one that has died is never answered: at its lock, its
/// socket, and the configuration that it was started with. Thread safety: from any thread.
/// Real-time: set-up only, it reads files.
Roudi find_roudi();

/// Memory for messages of a size, and for smaller ones that have no pool of their own.
struct ChunkPool {
  std::size_t message_bytes = 0;
  std::size_t chunks = 0;
};

/// What a publisher can have in use at once: eight loans, and the message that it sent last.
inline constexpr std::size_t kChunksOfWriter = 9;
/// The same for a subscription: what waits in iceoryx's queue, and what its callbacks have.
std::size_t chunks_of_reader(std::size_t depth, std::size_t message_bytes) noexcept;

/// A RouDi of our own, which does not watch its clients: they survive being stopped for seconds,
/// and one that is killed gives nothing back before RouDi ends. It ends with this object, or with
/// the thread that has made it; whoever still talks by its memory can go on.
/// Thread safety: for one thread. Make it before the process has other threads.
class RoudiProcess {
 public:
  /// Waits until it serves. Throws Error when it does not: it is not installed, another runs, or
  /// /dev/shm has no room.
  explicit RoudiProcess(std::vector<ChunkPool> pools);
  ~RoudiProcess();
  RoudiProcess(const RoudiProcess&) = delete;
  RoudiProcess& operator=(const RoudiProcess&) = delete;

  pid_t pid() const noexcept { return pid_; }
  static bool is_installed();

 private:
  pid_t pid_ = 0;
  std::string folder_;  // of its configuration and its log
};

// ---- For the transport ----

/// What lies before each message in its chunk, so that a reader believes nothing it has not seen.
struct ChunkHeader {
  std::uint64_t layout_hash = 0;
  std::uint64_t participant = 0;  // of the sender
  std::uint64_t writer = 0;
  std::uint64_t sequence = 0;  // 1, 2, … of the writer
  std::uint64_t before = 0;    // how many it had sent when its newest reader came
};

/// How many messages of a reader iceoryx keeps until our listener has been called: as many as the
/// reader wants, and more while they are small, for a listener that comes late.
std::size_t shared_queue_depth(std::size_t depth, std::size_t message_bytes) noexcept;
/// How many messages a reader holds where they lie. What comes beyond is copied.
std::size_t shared_messages_held(std::size_t depth) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_HPP_
