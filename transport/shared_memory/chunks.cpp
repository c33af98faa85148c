// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>

#include <dds/ddsi/ddsi_shm_transport.h>
#include <fmt/format.h>

#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

// iceoryx's listener has room for 127 readers of a process; Cyclone crashes at the next one.
// Limit: subscriptions of a process that use shared memory. At it: further ones use UDP, or are
// refused with `require`. Seen: the column `transport`; the error.
constexpr std::size_t kMostSharedReaders = 120;
constexpr std::size_t kChunkAlignment = 8;  // Cyclone asks for no more
// Limit: messages that a subscription holds in shared memory. At it: further ones are copied. Seen:
// `uncopied`.
constexpr std::size_t kMostHeld = 240;               // iceoryx allows 256
constexpr std::size_t kQueuedSmall = 100;            // messages, while they are small: …
constexpr std::size_t kQueuedBytes = 1024UL * 1024;  // … all of them together
constexpr std::size_t kInCallbacks = 8;

// The RouDi that this process first used: iceoryx binds a process to one.
std::uint64_t bind_to(const Roudi& roudi) {
  static std::atomic<std::uint64_t> bound{0};
  std::uint64_t before = 0;
  return bound.compare_exchange_strong(before, roudi.identity) ? roudi.identity : before;
}

}  // namespace

std::string why_not(const Roudi& roudi) {
  if (!roudi.unusable.empty()) return roudi.unusable;
  if (bind_to(roudi) != roudi.identity) return "RouDi was started again after this process";
  return {};
}

std::string shared_memory_settings(std::uint64_t roudi, const std::string& prefix) {
  if (roudi == 0) return "<Enable>false</Enable>";
  // The locator identifies processes that share memory: those of Takt on this machine, with this
  // RouDi. The memory layout of other processes' messages is unknown.
  std::string xml =
      "<Enable>true</Enable><LogLevel>fatal</LogLevel><Locator>74:61:6b:74:00:00:00:00";
  for (int byte = 0; byte < 8; ++byte) xml += fmt::format(":{:02x}", (roudi >> (8 * byte)) & 0xff);
  // iceoryx ignores discovery: any process with the same prefix gets the messages.
  return xml + fmt::format("</Locator><Prefix>{}</Prefix>", prefix);
}

std::string why_no_chunk(const MessageType& type, const Roudi& roudi, bool is_writer) {
  if (const std::string why = why_not(roudi); !why.empty()) return why;
  if (type.alignment > kChunkAlignment) return fmt::format("aligned to {} bytes", type.alignment);
  if (type.size > roudi.largest_message) {
    return fmt::format("{} bytes do not fit into RouDi's largest pool", type.size);
  }
  if (!is_writer && shared_reader_count() >= kMostSharedReaders) {
    return fmt::format("{} subscriptions of this process use it already", kMostSharedReaders);
  }
  return {};
}

ddsi_serdata_ops with_chunks(ddsi_serdata_ops ops, FromChunk from_chunk) {
  ops.get_sample_size = ddsi_serdata_iox_size;
  ops.from_iox_buffer = from_chunk;
  return ops;
}

void set_chunk_size(ddsi_sertype& type, std::size_t message_bytes) {
  type.iox_size = static_cast<std::uint32_t>(sizeof(ChunkHeader) + message_bytes);
}

void put_chunk(ddsi_serdata& data, void* subscriber, void* chunk) noexcept {
  data.iox_subscriber = subscriber;
  data.iox_chunk = chunk;
}

const ChunkHeader* chunk_of(const ddsi_serdata& data, const MessageType& type) noexcept {
  if (data.iox_chunk == nullptr ||
      iceoryx_header_from_chunk(data.iox_chunk)->data_size != sizeof(ChunkHeader) + type.size) {
    return nullptr;
  }
  const auto* chunk = static_cast<const ChunkHeader*>(data.iox_chunk);
  return chunk->layout_hash == type.layout_hash ? chunk : nullptr;
}

bool free_chunk(ddsi_serdata& data) noexcept {
  if (data.iox_chunk == nullptr) return false;
  if (data.iox_subscriber == nullptr) return true;
  order_before_next_loan(data.iox_chunk);
  free_iox_chunk(static_cast<iox_sub_t*>(data.iox_subscriber), &data.iox_chunk);
  return false;
}

std::size_t shared_queue_depth(std::size_t depth, std::size_t message_bytes) noexcept {
  const std::size_t more =
      std::min(kQueuedSmall, kQueuedBytes / std::max<std::size_t>(message_bytes, 1));
  return std::min(std::max(depth, more), kMostQueued);
}

std::size_t shared_messages_held(std::size_t depth) noexcept {
  return std::min(depth + kInCallbacks, kMostHeld);
}

std::size_t chunks_of_reader(std::size_t depth, std::size_t message_bytes) noexcept {
  // Plus the message that is being received.
  return shared_queue_depth(depth, message_bytes) + shared_messages_held(depth) + 1;
}

}  // namespace takt
