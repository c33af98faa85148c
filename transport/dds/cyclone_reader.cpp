// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <dds/dds.h>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/transport/dds/cyclone_participant.hpp"
#include "takt/transport/dds/writer_clocks.hpp"
#include "takt/transport/dds/writer_sequences.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

class CycloneReader final : public CycloneEndpoint, SharedReader {
 public:
  CycloneReader(CycloneParticipant& participant, IntraProcessReader& reader)
      : CycloneEndpoint(participant, reader.endpoint(), false),
        reader_(reader),
        clocks_(participant.clocks_are_synchronized()),
        most_held_(shared_messages_held(endpoint_.qos.depth)),
        blocks_(Pool<ReceivedBlock>::create(endpoint_.qos.depth + 8)) {
    const Listener listener(dds_create_listener(this), &dds_delete_listener);
    dds_lset_subscription_matched(
        listener.get(),
        [](dds_entity_t handle, const dds_subscription_matched_status_t status, void* self) {
          auto& end = *static_cast<CycloneReader*>(self);
          end.note_match(handle, status.last_publication_handle, status.current_count_change);
          end.count_matched(handle, status.current_count, status.current_count_change);
        });
    dds_lset_requested_incompatible_qos(
        listener.get(),
        [](dds_entity_t, const dds_requested_incompatible_qos_status_t status, void* self) {
          static_cast<CycloneReader*>(self)->events().incompatible(
              policy_name(status.last_policy_id));
        });
    dds_lset_liveliness_changed(
        listener.get(), [](dds_entity_t, const dds_liveliness_changed_status_t status, void* self) {
          static_cast<CycloneReader*>(self)->events().liveliness_changed(
              status.alive_count_change, status.not_alive_count_change);
        });
    dds_lset_sample_lost(listener.get(),
                         [](dds_entity_t, const dds_sample_lost_status_t status, void* self) {
                           static_cast<CycloneReader*>(self)->events().lost(
                               static_cast<std::uint64_t>(status.total_count_change));
                         });
    dds_lset_data_available(listener.get(), [](dds_entity_t handle, void* self) {
      static_cast<CycloneReader*>(self)->receive(handle);
    });
    make(&dds_create_reader, queue_depth(), listener);
    if (is_shared()) register_reader();
  }
  ~CycloneReader() override { unregister_reader(); }

  std::uint64_t received() const noexcept { return messages_.load(); }

  /// After this nothing arrives any more. Messages that were not taken are given back.
  void close() noexcept {
    CycloneEndpoint::close();
    for (bool more = !is_idle(); more;) {
      if (MessageBlock* message = reader_.take(more)) message->release();
    }
  }

 private:
  // The depth of Cyclone's queue. Cyclone's receive thread takes each message before it stores the
  // next one; publishers of this process store on their own threads, several at a time.
  std::size_t queue_depth() const noexcept {
    // Limit: messages that publishers of the own process put into a DDS queue at the same time. At
    // it: the oldest is overwritten. Seen: `lost`.
    constexpr std::size_t kMostAtATime = 100;
    const std::size_t depth = endpoint_.qos.depth;
    if (is_shared()) return shared_queue_depth(depth, endpoint_.type->size);
    return participant_->serves_own_process() ? std::max(depth, kMostAtATime) : depth;
  }

  // Runs on a thread of Cyclone or iceoryx, or of a publisher of this process.
  void receive(dds_entity_t handle) noexcept {
    const ForeignCode cyclone;
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    while (dds_takecdr(handle, &sample, 1, &info, DDS_ANY_STATE) == 1) {
      const ChunkHeader* chunk = chunk_of(*sample, *endpoint_.type);
      if (!info.valid_data || (chunk != nullptr && chunk->participant == participant_->id() &&
                               !participant_->serves_own_process())) {  // came by pointer already
        ddsi_serdata_unref(sample);
        continue;
      }
      ReceivedBlock* block = blocks_->acquire();
      if (block == nullptr) {
        block = new ReceivedBlock;
        block->from_heap = true;
      }
      if (chunk != nullptr) {
        count_overwritten(*chunk, handle, info.publication_handle);
        hold(*block, sample, chunk + 1);
      } else {
        block->hold(sample);
      }
      if (is_service_) note_caller(*block, handle, info.publication_handle);
      block->set_references(1);
      messages_.fetch_add(1, std::memory_order_relaxed);
      const WriterClocks::Times times = clocks_.times_of(handle, info);
      if (times.expiry != kNever || block->can_expire())  // as its last message
        block->expire_at(times.expiry, Clock::steady());
      ReleasedMessages released;
      const ReadSection section;
      const Arrival arrival{next_sequence(), times.sent};
      block->origin = {.source_time = std::chrono::system_clock::time_point(
                           std::chrono::nanoseconds(info.source_timestamp)),
                       .writer = info.publication_handle};
      block->envelope = {.sequence = arrival.sequence, .ready_time = arrival.ready_time};
      reader_.deliver(*block, arrival, released);
    }
  }

  // Notes which DDS writer belongs to the client of a request.
  void note_caller(const ReceivedBlock& request, dds_entity_t handle,
                   dds_instance_handle_t writer) {
    if (!services_->knows(ServiceMatches::requests, writer)) note_match(handle, writer, 1);
    const auto client = request.address();
    if (!client || services_->called(*client, writer)) return;
    if (static constinit LogThrottle throttle; throttle.may_log()) {
      log(LogLevel::warn, "service '{}': a client changes its number with its requests",
          endpoint_.topic);
    }
  }

  void hold(ReceivedBlock& block, ddsi_serdata* sample, const void* payload) {
    if (held_.load() < most_held_) {
      held_.fetch_add(1);
      uncopied_.fetch_add(1, std::memory_order_relaxed);
      block.hold_chunk(sample, payload, held_);
    } else {
      block.hold_copy(payload, endpoint_.type->size);
      ddsi_serdata_unref(sample);
    }
  }

  // `reader` is the value of handle_, which may not be stored yet.
  void count_overwritten(const ChunkHeader& chunk, dds_entity_t reader,
                         dds_instance_handle_t writer) {
    const auto is_matched = [reader](dds_instance_handle_t other) {
      auto* data = dds_get_matched_publication_data(reader, other);
      if (data != nullptr) dds_builtintopic_free_endpoint(data);
      return data != nullptr;
    };
    std::uint64_t overwritten = sequences_.overwritten(chunk, writer, is_matched);
    const std::uint64_t counted = std::min(overwritten, refused_);  // already counted as lost
    refused_ -= counted;
    overwritten -= counted;
    if (overwritten != 0) count_lost(overwritten);
  }
  void count_lost(std::uint64_t overwritten) {
    messages_.fetch_add(overwritten, std::memory_order_relaxed);
    lost_.fetch_add(overwritten, std::memory_order_relaxed);
    reader_.miss(overwritten);
    events().lost(overwritten);
  }

  void refused() noexcept override {
    ++refused_;
    count_lost(1);
  }
  std::string_view topic() const noexcept override { return endpoint_.topic; }

  EndpointEvents& events() const noexcept override { return *reader_.events(); }

  IntraProcessReader& reader_;
  WriterClocks clocks_;  // only in receive
  const std::size_t most_held_;
  const PoolPtr<ReceivedBlock> blocks_;
  WriterSequences sequences_;  // only in receive
  std::uint64_t refused_ = 0;  // not yet found missing in the sequence; only in receive
};

/// The subscription's handle of a CycloneReader, which may live longer.
class ReaderEnd final : public RemoteReader {
 public:
  explicit ReaderEnd(std::unique_ptr<CycloneReader> reader) : reader_(std::move(reader)) {}
  ~ReaderEnd() override {
    reader_->close();
    put_away(std::move(reader_));
  }
  std::size_t writer_count() const noexcept override { return reader_->matched(); }
  std::uint64_t received() const noexcept override { return reader_->received(); }
  EndpointId gid() const noexcept override { return reader_->state().gid; }

 private:
  std::unique_ptr<CycloneReader> reader_;
};

}  // namespace

std::unique_ptr<RemoteReader> make_reader(CycloneParticipant& participant,
                                          IntraProcessReader& reader) {
  return std::make_unique<ReaderEnd>(std::make_unique<CycloneReader>(participant, reader));
}

}  // namespace takt
