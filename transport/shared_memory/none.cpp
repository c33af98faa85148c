// A build without shared memory: all messages to other processes go by UDP.
// SPDX-License-Identifier: Apache-2.0
#include <dds/dds.h>

#include "takt/base/error.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"
#include "takt/transport/shared_memory/lock_file.hpp"

namespace takt {
namespace {

constexpr const char* kNone = "this Takt was built without shared memory";

}  // namespace

Roudi find_roudi() {
  return {.unusable = kNone};
}

RoudiProcess::RoudiProcess(const std::function<std::vector<ChunkPool>()>&) {
  throw Error(kNone, "build it with -DTAKT_SHARED_MEMORY=ON, or say `dds: {shared_memory: auto}`");
}
RoudiProcess::~RoudiProcess() = default;

bool RoudiProcess::is_installed() {
  return false;
}

std::string why_not(const Roudi& roudi) {
  return roudi.unusable;
}

std::string shared_memory_settings(std::uint64_t, const std::string&) {
  return "<Enable>false</Enable>";
}

void delete_within_bound(std::int32_t entity) {
  dds_delete(entity);
}

void bound_exit() {
}

std::string why_no_chunk(const MessageType&, const Roudi& roudi, bool) {
  return roudi.unusable;
}

ddsi_serdata_ops with_chunks(ddsi_serdata_ops ops, FromChunk) {
  return ops;
}

void set_chunk_size(ddsi_sertype&, std::size_t) {
}

void put_chunk(ddsi_serdata&, void*, void*) noexcept {
}

const ChunkHeader* chunk_of(const ddsi_serdata&, const MessageType&) noexcept {
  return nullptr;
}

bool free_chunk(ddsi_serdata&) noexcept {
  return false;
}

std::size_t chunks_of_reader(std::size_t depth, std::size_t) noexcept {
  return depth;
}

std::size_t shared_queue_depth(std::size_t depth, std::size_t) noexcept {
  return depth;
}

std::size_t shared_messages_held(std::size_t) noexcept {
  return 0;
}

void SharedReader::register_reader() {
}

void SharedReader::unregister_reader() noexcept {
}

std::size_t shared_reader_count() noexcept {
  return 0;
}

bool count_refused(std::string_view) noexcept {
  return false;
}

}  // namespace takt
