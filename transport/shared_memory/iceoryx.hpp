// What the transport asks of iceoryx, below Cyclone DDS. All that knows iceoryx's inside is in this
// folder; without it (TAKT_SHARED_MEMORY=OFF) none.cpp answers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_ICEORYX_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_ICEORYX_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <dds/ddsi/ddsi_serdata.h>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

namespace TAKT_INTERNAL takt {

// ---- A process and its RouDi ----

/// Why this process cannot use the RouDi that runs now; empty: it can. iceoryx binds a process to
/// the first one.
std::string why_not(const Roudi& roudi);
/// The content of Cyclone's <SharedMemory>. `roudi`: the identity of the one in use; 0: none.
/// Readers and writers share memory if they have the same prefix.
std::string shared_memory_settings(std::uint64_t roudi, const std::string& prefix);

/// Deletes an entity of Cyclone DDS of a domain with shared memory. One that is not deleted within
/// 3 s waits for a lock of iceoryx's that a killed process has kept: an error is logged, and it is
/// left as it is. So are those that are to be deleted later, as they may wait for it.
/// Thread safety: from any thread. Real-time: set-up only.
void delete_within_bound(std::int32_t entity);
/// From here on `exit` ends the process within 3 s, with the status that was asked for, though
/// iceoryx still waits for RouDi's answer to its goodbye; and delete_within_bound deletes nothing
/// any more when iceoryx' static objects go. Call it when iceoryx has begun.
void bound_exit();

// ---- Chunks: pieces of shared memory, each with one message ----

/// What lies before each message in its chunk, so that a reader believes nothing it has not seen.
struct ChunkHeader {
  std::uint64_t layout_hash = 0;
  std::uint64_t participant = 0;  // of the sender
  std::uint64_t writer = 0;
  std::uint64_t sequence = 0;  // 1, 2, … of the writer
  std::uint64_t before = 0;    // how many it had sent when its newest reader came
};

/// Why messages of this type cannot lie in RouDi's chunks; empty: they can.
std::string why_no_chunk(const MessageType& type, const Roudi& roudi, bool is_writer);
/// Makes a serdata of a chunk: one that a subscriber has received, or, without one, is to be sent.
using FromChunk = ddsi_serdata* (*)(const ddsi_sertype*, ddsi_serdata_kind, void* subscriber,
                                    void* chunk);
/// Adds to Cyclone's functions of serdata those of chunks.
ddsi_serdata_ops with_chunks(ddsi_serdata_ops ops, FromChunk from_chunk);
/// Says how large the messages of a type are.
void set_chunk_size(ddsi_sertype& type, std::size_t message_bytes);
void put_chunk(ddsi_serdata& data, void* subscriber, void* chunk) noexcept;
/// The chunk in which this serdata's message lies, if it is of this type; nullptr: in none.
const ChunkHeader* chunk_of(const ddsi_serdata& data, const MessageType& type) noexcept;

// A chunk goes from its reader to the next writer through iceoryx's pool, which is built without
// the thread sanitizer. These say to it what the pool's atomics order.
#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
inline void order_before_next_loan(void* chunk) noexcept {
  __tsan_release(chunk);
}
inline void order_after_last_use(void* chunk) noexcept {
  __tsan_acquire(chunk);
}
#else
inline void order_before_next_loan(void*) noexcept {
}
inline void order_after_last_use(void*) noexcept {
}
#endif
/// Gives a chunk back that was received. Returns true if there is one that could not be sent.
bool free_chunk(ddsi_serdata& data) noexcept;

/// How many messages of a reader iceoryx keeps until our listener has been called: as many as the
/// reader wants, and more while they are small, for a listener that comes late.
std::size_t shared_queue_depth(std::size_t depth, std::size_t message_bytes) noexcept;
/// How many messages a reader holds where they lie. What comes beyond is copied.
std::size_t shared_messages_held(std::size_t depth) noexcept;

// ---- What iceoryx refuses to give to a reader, which only the log of Cyclone shows ----

/// A reader by shared memory, known from `register_reader` to `unregister_reader`.
class SharedReader {
 public:
  void register_reader();
  void unregister_reader() noexcept;

 protected:
  SharedReader() = default;
  ~SharedReader() = default;

  /// A message of it is lost. On iceoryx's listener thread, which is also the one that receives.
  virtual void refused() noexcept = 0;
  virtual std::string_view topic() const noexcept = 0;

 private:
  friend bool count_refused(std::string_view) noexcept;
  std::uint64_t refused_ = 0;
};

/// How many readers are registered.
std::size_t shared_reader_count() noexcept;

/// Whether the complaint of Cyclone's says that iceoryx has refused a message, as a reader holds
/// 256 already, or chunks were lost with publishers that were killed. Then it is counted by a
/// reader of that topic, and logged once a second. Several readers of a topic take turns, as the
/// complaint does not name one.
bool count_refused(std::string_view complaint) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_ICEORYX_HPP_
