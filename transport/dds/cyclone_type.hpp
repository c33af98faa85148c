// How Cyclone DDS sees a MessageType: its sertype and serdata.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_CYCLONE_TYPE_HPP_
#define TAKT_TRANSPORT_DDS_CYCLONE_TYPE_HPP_

#include <atomic>
#include <memory>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include "takt/base/lockfree/pool.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_INTERNAL takt {

/// A message on its way through Cyclone: its bytes, or the chunk of shared memory that it lies in.
struct Serdata : ddsi_serdata, PoolNode<Serdata> {
  ByteBuffer buffer;  // with up to 3 zero bytes at the end, which Cyclone may send
  std::size_t size = 0;
  std::size_t received = 0;  // bytes, as long as a process of others has sent it: see Sertype
  bool from_heap = false;

  std::span<const std::byte> bytes() const noexcept { return buffer.bytes().first(size); }
};

/// Thread safety: Cyclone's.
struct Sertype : ddsi_sertype {
  /// `in_shared_memory`: messages for readers that share memory with us lie in chunks, each behind
  /// a ChunkHeader.
  Sertype(const MessageType& message_type, bool in_shared_memory);
  ~Sertype();
  const MessageType& message;
  const PoolPtr<Serdata> pool;
  mutable std::atomic<Serdata*> unsent{nullptr};  // see free_data

  /// Whether a message of so many bytes may come in, beside those that are there, in queues or in
  /// callbacks: depths count messages, and others choose how long these are. Counts it, until
  /// leave().
  bool let_in(Serdata& data, std::size_t bytes) const noexcept;
  void leave(Serdata& data) const noexcept;

 private:
  const std::size_t most_each_, most_in_all_;
  mutable std::atomic<std::size_t> bytes_{0};
};

/// The message's bytes, owned by the caller. For `dds_writecdr`, which takes them over.
ddsi_serdata* encode(const Sertype& type, const void* message);

/// What no reader delivers, but confirms: that this writer, which has written nothing, has gone.
ddsi_serdata* make_question(const Sertype& type);

/// "sensor_msgs/msg/LaserScan" → "sensor_msgs::msg::dds_::LaserScan_". A name without a slash is
/// that of an IDL type, and stays.
std::string dds_type_name(std::string_view name);
/// "/scan" → "rt/scan"; the topics of services have their prefix already.
std::string dds_topic_name(std::string_view topic);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_CYCLONE_TYPE_HPP_
