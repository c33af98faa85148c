// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_type.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>

#include <dds/ddsi/q_radmin.h>

#include "takt/transport/dds/most_received.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

constexpr std::size_t kPooled = 64;            // serdata kept in the pool of a type
constexpr std::size_t kKeptBytes = 64 * 1024;  // a larger buffer is freed with its message

// Limit: bytes of all messages from other processes of a service by which processes and containers
// are asked (parameters, statistics, loading). At it: the newest is dropped. Seen: the warning of
// Cyclone DDS.
constexpr std::size_t kMostOfServices = std::size_t{64} << 20;

/// Whether the type's name is that of such a service.
bool is_of_service(std::string_view type) {
  constexpr std::string_view kPackages[] = {"rcl_interfaces/srv/",          "takt_interfaces/srv/",
                                            "composition_interfaces/",      "lifecycle_msgs/srv/",
                                            "type_description_interfaces/", "rmw_dds_common/"};
  return std::any_of(std::begin(kPackages), std::end(kPackages),
                     [&](std::string_view package) { return type.starts_with(package); });
}

Serdata& of(ddsi_serdata* data) noexcept {
  return static_cast<Serdata&>(*data);
}
const Serdata& of(const ddsi_serdata* data) noexcept {
  return static_cast<const Serdata&>(*data);
}
const Sertype& of(const ddsi_sertype* type) noexcept {
  return static_cast<const Sertype&>(*type);
}

Serdata* allocate() {
  auto* data = new Serdata;
  data->from_heap = true;
  return data;
}

Serdata* make(const Sertype& type, ddsi_serdata_kind kind) {
  Serdata* data = type.pool->acquire();
  if (data == nullptr) data = allocate();
  data->buffer.clear();
  data->size = 0;
  ddsi_serdata_init(data, &type, kind);
  return data;
}

// Cyclone sends in units of four bytes: padding follows.
void finish(Serdata& data) {
  data.size = data.buffer.bytes().size();
  std::fill_n(data.buffer.extend(3), 3, std::byte{0});
}

// ---- ddsi_serdata_ops. There are no keys: all samples of a topic are of one instance. ----

bool equal_keys(const ddsi_serdata*, const ddsi_serdata*) {
  return true;
}

std::uint32_t size_of(const ddsi_serdata* data) {
  return static_cast<std::uint32_t>(of(data).size);
}

// Cyclone's thread checks only the encapsulation header; the receiver decodes.
ddsi_serdata* checked(Serdata* data) {
  finish(*data);
  const auto bytes = data->bytes();
  if (data->kind == SDK_DATA && (bytes.size() < kCdrHeader.size() || bytes[0] != kCdrHeader[0] ||
                                 bytes[1] != kCdrHeader[1])) {
    ddsi_serdata_unref(data);
    return nullptr;
  }
  return data;
}

// Fragments are sorted by their begin, and may overlap.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragment, std::size_t size) {
  Serdata* data = make(of(type), kind);
  if (!of(type).let_in(*data, size)) {
    ddsi_serdata_unref(data);
    return nullptr;
  }
  std::byte* to = data->buffer.extend(size);
  std::uint32_t done = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    const std::uint32_t end = std::min(fragment->maxp1, static_cast<std::uint32_t>(size));
    if (end <= done || fragment->min > done) continue;
    const auto* payload = reinterpret_cast<const std::byte*>(
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)));
    std::copy(payload + (done - fragment->min), payload + (end - fragment->min), to + done);
    done = end;
  }
  std::fill(to + done, to + size, std::byte{0});
  return checked(data);
}

ddsi_serdata* from_vector(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* parts, std::size_t size) {
  Serdata* data = make(of(type), kind);
  std::byte* to = data->buffer.extend(size);
  for (ddsrt_msg_iovlen_t i = 0; i < count; ++i) {
    const auto* from = static_cast<const std::byte*>(parts[i].iov_base);
    const std::size_t length = std::min<std::size_t>(parts[i].iov_len, size);
    to = std::copy_n(from, length, to);
    size -= length;
  }
  return checked(data);
}

ddsi_serdata* from_key(const ddsi_sertype* type, const ddsi_keyhash*) {
  return make(of(type), SDK_KEY);
}
// Encodes a chunk for readers that do not share memory with us.
ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* chunk) {
  return kind == SDK_DATA ? encode(of(type), static_cast<const ChunkHeader*>(chunk) + 1)
                          : make(of(type), kind);
}
// `subscriber` is nullptr when the chunk is to be sent.
ddsi_serdata* from_chunk(const ddsi_sertype* type, ddsi_serdata_kind kind, void* subscriber,
                         void* chunk) {
  Serdata* data = make(of(type), kind);
  put_chunk(*data, subscriber, chunk);
  return data;
}

void to_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
  std::copy_n(of(data).buffer.bytes().data() + offset, size, static_cast<std::byte*>(to));
}
ddsi_serdata* to_bytes_ref(const ddsi_serdata* data, std::size_t offset, std::size_t size,
                           ddsrt_iovec_t* ref) {
  ref->iov_base = const_cast<std::byte*>(of(data).buffer.bytes().data() + offset);
  ref->iov_len = size;
  return ddsi_serdata_ref(data);
}
void to_bytes_unref(ddsi_serdata* data, const ddsrt_iovec_t*) {
  ddsi_serdata_unref(data);
}

bool to_sample(const ddsi_serdata* data, void* sample, void**, void*) {
  return of(data->type).message.decode(of(data).bytes(), sample);
}
// The result stays in Cyclone's instance map: so it is a serdata of its own, without the bytes.
ddsi_serdata* to_untyped(const ddsi_serdata* data) {
  Serdata* untyped = allocate();
  ddsi_serdata_init(untyped, data->type, SDK_KEY);
  untyped->type = nullptr;
  return untyped;
}
bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
  return true;
}

void free_data(ddsi_serdata* data) {
  Serdata* last = &of(data);
  if (free_chunk(*last)) {
    // The chunk could not be sent. Cyclone 0.10.2 reads the serdata once more after this call: so
    // it is freed at the next failure.
    last = of(last->type).unsent.exchange(last);
    if (last == nullptr) return;
  }
  Serdata& ours = *last;
  if (ours.type != nullptr) of(ours.type).leave(ours);
  if (ours.from_heap) {
    delete &ours;
    return;
  }
  if (ours.buffer.bytes().size() > kKeptBytes) ours.buffer = {};
  Pool<Serdata>::recycle(ours);
}

std::size_t print(const ddsi_sertype* type, const ddsi_serdata* data, char* to, std::size_t size) {
  return static_cast<std::size_t>(
      snprintf(to, size, "%s of %zu bytes", type->type_name, of(data).size));
}
void key_hash(const ddsi_serdata*, ddsi_keyhash* hash, bool) {
  *hash = {};
}

const ddsi_serdata_ops kSerdataOps = with_chunks({.eqkey = equal_keys,
                                                  .get_size = size_of,
                                                  .from_ser = from_fragments,
                                                  .from_ser_iov = from_vector,
                                                  .from_keyhash = from_key,
                                                  .from_sample = from_sample,
                                                  .to_ser = to_bytes,
                                                  .to_ser_ref = to_bytes_ref,
                                                  .to_ser_unref = to_bytes_unref,
                                                  .to_sample = to_sample,
                                                  .to_untyped = to_untyped,
                                                  .untyped_to_sample = untyped_to_sample,
                                                  .free = free_data,
                                                  .print = print,
                                                  .get_keyhash = key_hash},
                                                 from_chunk);

// ---- ddsi_sertype_ops ----

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete static_cast<Sertype*>(type);
}
bool equal_types(const ddsi_sertype* a, const ddsi_sertype* b) {
  return of(a).message.layout_hash == of(b).message.layout_hash && a->fixed_size == b->fixed_size;
}
std::uint32_t hash_of(const ddsi_sertype* type) {
  return static_cast<std::uint32_t>(of(type).message.layout_hash);
}
// Cyclone never needs samples of this type, as we never ask for any.
void zero_samples(const ddsi_sertype*, void*, std::size_t) {
}
void realloc_samples(void** pointers, const ddsi_sertype*, void*, std::size_t, std::size_t count) {
  std::fill_n(pointers, count, nullptr);
}
void free_samples(const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {
}

const ddsi_sertype_ops kSertypeOps{.version = ddsi_sertype_v0,
                                   .arg = nullptr,
                                   .free = free_type,
                                   .zero_samples = zero_samples,
                                   .realloc_samples = realloc_samples,
                                   .free_samples = free_samples,
                                   .equal = equal_types,
                                   .hash = hash_of,
                                   .type_id = nullptr,
                                   .type_map = nullptr,
                                   .type_info = nullptr,
                                   .derive_sertype = nullptr,
                                   .get_serialized_size = nullptr,
                                   .serialize_into = nullptr};

}  // namespace

Sertype::Sertype(const MessageType& message_type, bool in_shared_memory)
    : ddsi_sertype{},
      message(message_type),
      pool(Pool<Serdata>::create(kPooled)),
      most_each_(is_of_service(message.name) ? kMostOfServices : SIZE_MAX),
      most_in_all_(is_of_service(message.name) ? kMostOfServices : kMostReceived) {
  ddsi_sertype_init_flags(
      this, dds_type_name(message.name).c_str(), &kSertypeOps, &kSerdataOps,
      DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY | (in_shared_memory ? DDSI_SERTYPE_FLAG_FIXED_SIZE : 0));
  allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  if (in_shared_memory) set_chunk_size(*this, message.size);
}

Sertype::~Sertype() {
  Serdata* data = unsent.load();
  if (data != nullptr && data->from_heap) {
    delete data;
  } else if (data != nullptr) {
    Pool<Serdata>::recycle(*data);
  }
}

bool Sertype::let_in(Serdata& data, std::size_t bytes) const noexcept {
  if (bytes > most_each_) return false;
  const std::size_t before = bytes_.fetch_add(bytes, std::memory_order_relaxed);  // a sum only
  data.received = bytes;
  if (before == 0 || before + bytes <= most_in_all_) return true;
  leave(data);
  return false;
}

void Sertype::leave(Serdata& data) const noexcept {
  const std::size_t bytes = std::exchange(data.received, 0);
  if (bytes != 0) bytes_.fetch_sub(bytes, std::memory_order_relaxed);
}

ddsi_serdata* encode(const Sertype& type, const void* message) {
  Serdata* data = make(type, SDK_DATA);
  type.message.encode(message, data->buffer);
  finish(*data);
  return data;
}

ddsi_serdata* make_question(const Sertype& type) {
  Serdata* data = allocate();  // the pool is for messages
  ddsi_serdata_init(data, &type, SDK_KEY);
  std::copy(kCdrHeader.begin(), kCdrHeader.end(), data->buffer.extend(kCdrHeader.size()));
  finish(*data);
  data->statusinfo = NN_STATUSINFO_UNREGISTER;
  return data;
}

std::string dds_type_name(std::string_view name) {
  if (name.find('/') == std::string_view::npos) return std::string(name);
  std::string result;
  for (std::size_t slash; (slash = name.find('/')) != std::string_view::npos;) {
    result.append(name.substr(0, slash)).append("::");
    name.remove_prefix(slash + 1);
  }
  return result.append("dds_::").append(name).append("_");
}

std::string dds_topic_name(std::string_view topic) {
  return topic.starts_with('/') ? "rt" + std::string(topic) : std::string(topic);
}

}  // namespace takt
