// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>

#include "takt/base/logger.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/transport/dds/cyclone_participant.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

class CycloneWriter;

/// A loaned message in shared memory that is not sent yet.
class LentBlock final : public MessageBlock, public PoolNode<LentBlock> {
 public:
  void lend(CycloneWriter& writer, ChunkHeader* chunk) noexcept {
    writer_ = &writer;
    chunk_ = chunk;
    payload_ = chunk + 1;
    set_references(1);
  }
  ChunkHeader* take() noexcept { return std::exchange(chunk_, nullptr); }

 private:
  void recycle() noexcept override;

  CycloneWriter* writer_ = nullptr;
  ChunkHeader* chunk_ = nullptr;
};

class CycloneWriter final : public CycloneEndpoint {
 public:
  CycloneWriter(CycloneParticipant& participant, const Endpoint& endpoint,
                std::shared_ptr<EndpointEvents> events)
      : CycloneEndpoint(participant, endpoint, true),
        events_(std::move(events)),
        lent_(Pool<LentBlock>::create(is_shared() ? kMostLent : 0)) {
    const Listener listener(dds_create_listener(this), &dds_delete_listener);
    dds_lset_publication_matched(
        listener.get(),
        [](dds_entity_t handle, const dds_publication_matched_status_t status, void* self) {
          auto& writer = *static_cast<CycloneWriter*>(self);
          if (status.total_count_change > 0) writer.readers_ever_.fetch_add(1);
          if (status.current_count_change > 0) writer.ask(handle);  // before the reader is counted
          writer.note_match(handle, status.last_subscription_handle, status.current_count_change);
          writer.count_matched(handle, status.current_count, status.current_count_change);
          writer.send_waiting();
        });
    dds_lset_offered_incompatible_qos(
        listener.get(),
        [](dds_entity_t, const dds_offered_incompatible_qos_status_t status, void* self) {
          static_cast<CycloneWriter*>(self)->events_->incompatible(
              policy_name(status.last_policy_id));
        });
    if (is_service_) look_again_.emplace(topic_, [this] { send_waiting(); });
    make(&dds_create_writer, endpoint_.qos.depth, listener);
    if (is_shared()) is_known_at_ = later(Clock::steady().now(), kHearsayTime);
    is_made_.store(true);
    ask(handle_);  // readers that matched during construction
  }

  ~CycloneWriter() override {
    look_again_.reset();
    if (question_ != nullptr) ddsi_serdata_unref(question_);
    for (const Waiting& response : waiting_) {
      if (response.data != nullptr) ddsi_serdata_unref(response.data);
    }
  }

  /// Whether nobody would receive a message that is written now.
  bool is_in_vain() const noexcept {
    return matched_.load(std::memory_order_relaxed) == 0 &&
           endpoint_.qos.durability == Durability::volatile_;
  }
  WallTime stamp() const noexcept { return is_in_vain() ? WallTime{} : WallTime::clock::now(); }
  void write(const void* message, WallTime time) noexcept {
    if (!is_service_ && is_in_vain()) return;
    const dds_time_t published = published_at(time);
    if (is_service_ && (waits(message, published) || is_in_vain())) return;
    const ForeignCode cyclone;
    if (is_shared()) return write_copy(message, published);
    count(dds_forwardcdr(handle_, encode_at(message, published)));
  }

  MessageBlock* lend(const void* prototype) noexcept {
    if (!is_shared() || matched() == 0) return nullptr;
    LentBlock* block = lent_->acquire();
    if (block == nullptr) return nullptr;
    ChunkHeader* chunk = borrow();
    if (chunk == nullptr) {
      Pool<LentBlock>::recycle(*block);
      return nullptr;
    }
    if (chunk->writer != id_ || chunk->layout_hash != endpoint_.type->layout_hash) {
      std::memcpy(chunk + 1, prototype, endpoint_.type->size);
      identify(*chunk);
    }
    held_.fetch_add(1);
    block->lend(*this, chunk);
    return block;
  }

  void write_lent(MessageBlock& message, WallTime time) noexcept {
    const dds_time_t published = published_at(time);
    const bool is_kept = is_service_ && waits(message.payload(), published);
    if (!is_kept && matched() != 0) {
      const ForeignCode cyclone;
      const std::lock_guard lock(mutex_);
      if (send(static_cast<LentBlock&>(message).take(), published)) {
        uncopied_.fetch_add(1, std::memory_order_relaxed);
      }
    }
    message.release();
  }

  void give_back(LentBlock& block) noexcept {
    if (void* chunk = block.take()) {
      const ForeignCode cyclone;
      dds_return_loan(handle_, &chunk, 1);
    }
    Pool<LentBlock>::recycle(block);
    held_.fetch_sub(1);  // after the last one, the writer may be freed
  }
  void assert_liveliness() noexcept { dds_assert_liveliness(handle_); }
  bool wait_for_acks(Nanoseconds timeout) noexcept {
    return dds_wait_for_acks(handle_, timeout.count()) == DDS_RETCODE_OK;
  }
  /// The matched readers. While a probe is not confirmed: those that had matched before the probe.
  std::size_t confirmed() const noexcept override {
    const std::size_t count = matched();
    return count == 0 || is_confirmed() ? count : std::min(count, known_before_.load());
  }
  /// For the requests of a client: at most the services whose responses the client can receive.
  std::size_t reader_count() const noexcept {
    const std::size_t count = confirmed();
    return services_ == nullptr || is_service_ ? count : std::min(count, services_->count());
  }

 private:
  // A reader that has just matched takes the message at its first heartbeat for an older one, and
  // the writer is not notified of heartbeats: a message written at once would be lost. So the
  // writer sends each new reader a probe (`question_`) to confirm, unless the topic has messages
  // already. The writer waits at most kPatience for a reader that has vanished.
  void ask(dds_entity_t handle) noexcept {
    constexpr auto kPatience = std::chrono::seconds(1);
    if (is_shared() || endpoint_.qos.reliability != Reliability::reliable ||
        endpoint_.qos.durability != Durability::volatile_ || !is_made_.load()) {
      return;
    }
    if (messages_.load() != 0 && services_ == nullptr) return;
    ddsi_serdata* const question = make_question(topic_.type());
    question->timestamp.v = dds_time();
    {
      const std::lock_guard lock(asking_mutex_);
      if (question_ == nullptr) known_before_.store(matched());
      if (question_ != nullptr) ddsi_serdata_unref(question_);
      question_ = ddsi_serdata_ref(question);
      asks_until_ = later(Clock::steady().now(), kPatience);
    }
    dds_forwardcdr(handle, question);
  }

  // All readers have confirmed the last probe when Cyclone no longer keeps it.
  bool is_confirmed() const noexcept {
    const std::lock_guard lock(asking_mutex_);
    if (question_ == nullptr) return true;
    if (ddsrt_atomic_ld32(&question_->refc) != 1 && Clock::steady().now() < asks_until_)
      return false;
    ddsi_serdata_unref(std::exchange(question_, nullptr));
    return true;
  }

  using Hearing = ServiceMatches::Hearing;
  static constexpr auto kBetweenLooks = std::chrono::milliseconds(1);

  /// A response for a client whose reader is not ready yet.
  struct Waiting {
    std::uint64_t client;
    ddsi_serdata* data;           // nullptr: in shared memory
    std::vector<std::byte> copy;  // for shared memory
    dds_time_t published;
  };

  static dds_time_t published_at(WallTime time) noexcept {
    return time == WallTime{} ? dds_time() : Nanoseconds(time.time_since_epoch()).count();
  }

  ddsi_serdata* encode_at(const void* message, dds_time_t published) const noexcept {
    ddsi_serdata* data = encode(topic_.type(), message);
    data->timestamp.v = published;  // forwardcdr keeps the time: latency includes encoding
    return data;
  }

  // Keeps a response while the client's reader is not discovered, which may come later than its
  // writer, or has not confirmed a probe. Beyond the depth, the oldest response is replaced.
  bool waits(const void* message, dds_time_t published) {
    const ForeignCode cyclone;
    std::uint64_t client = 0;
    std::memcpy(&client, message, sizeof client);
    const std::lock_guard lock(waiting_mutex_);  // else send_waiting may come between
    const Hearing hearing = hearing_of(client);
    if (hearing == Hearing::hears) return false;
    if (waiting_.size() == endpoint_.qos.depth) {
      if (waiting_.front().data != nullptr) ddsi_serdata_unref(waiting_.front().data);
      waiting_.erase(waiting_.begin());
      count(DDS_RETCODE_OUT_OF_RESOURCES);
    }
    const auto* bytes = static_cast<const std::byte*>(message);
    waiting_.push_back(
        is_shared() ? Waiting{client, nullptr, {bytes, bytes + endpoint_.type->size}, published}
                    : Waiting{client, encode_at(message, published), {}, published});
    if (hearing == Hearing::unknown) look_again_->set(kBetweenLooks);
    return true;
  }
  Hearing hearing_of(std::uint64_t client) noexcept {
    const Hearing hearing = services_->hearing(client);
    if (hearing != Hearing::unknown) return hearing;
    const std::uint64_t ends = services_->ends();  // read first: counted readers have got a probe
    if (!is_confirmed()) return hearing;
    services_->confirm(ends);
    return services_->hearing(client);
  }
  void send_waiting() noexcept {
    const std::lock_guard lock(waiting_mutex_);
    bool is_unknown = false;
    std::erase_if(waiting_, [&](const Waiting& response) {
      const Hearing hearing = hearing_of(response.client);
      is_unknown |= hearing == Hearing::unknown;
      if (hearing != Hearing::hears) return false;
      if (response.data != nullptr) {
        count(dds_forwardcdr(handle_, response.data));
      } else {
        write_copy(response.copy.data(), response.published);
      }
      return true;
    });
    if (is_unknown) look_again_->set(kBetweenLooks);
  }

  // Cyclone and iceoryx allow eight at once; one is for messages that are copied.
  // Limit: messages of a publisher that are loaned at the same time by shared memory. At it: a
  // further loan is an ordinary one, and is copied. Seen: `uncopied`.
  static constexpr std::size_t kMostLent = 7;

  ChunkHeader* borrow() const noexcept {
    const ForeignCode cyclone;
    void* chunk = nullptr;
    if (dds_loan_sample(handle_, &chunk) != DDS_RETCODE_OK) return nullptr;
    order_after_last_use(chunk);
    return static_cast<ChunkHeader*>(chunk);
  }
  void identify(ChunkHeader& chunk) const noexcept {
    chunk.layout_hash = endpoint_.type->layout_hash;
    chunk.participant = participant_->id();
    chunk.writer = id_;
  }

  void write_copy(const void* message, dds_time_t published) noexcept {
    if (matched() == 0) return;
    const std::lock_guard lock(mutex_);
    ChunkHeader* chunk = borrow();
    if (chunk == nullptr) {
      count(DDS_RETCODE_OUT_OF_RESOURCES);
      return;
    }
    std::memcpy(chunk + 1, message, endpoint_.type->size);
    send(chunk, published);
  }

  // Gives the chunk to Cyclone. With the mutex held, so that sequence numbers are in order of
  // sending.
  bool send(ChunkHeader* chunk, dds_time_t published) noexcept {
    identify(*chunk);
    if (const std::uint64_t readers = readers_ever_.load(); readers != readers_known_) {
      readers_known_ = readers;
      before_newest_ = sequence_;
    }
    chunk->sequence = sequence_ + 1;
    chunk->before = before_newest_;
    if (!count(dds_write_ts(handle_, chunk, published))) return false;
    ++sequence_;
    return true;
  }

  bool count(dds_return_t result) noexcept {
    if (result == DDS_RETCODE_OK) {
      messages_.fetch_add(1, std::memory_order_relaxed);
      return true;
    }
    lost_.fetch_add(1, std::memory_order_relaxed);
    if (static constinit LogThrottle throttle; throttle.may_log()) {
      log(LogLevel::warn, "{}: a message was not sent: the queue stayed full", endpoint_.topic);
    }
    return false;
  }

  EndpointEvents& events() const noexcept override { return *events_; }

  const std::shared_ptr<EndpointEvents> events_;
  const std::uint64_t id_ = random_number();
  const PoolPtr<LentBlock> lent_;
  RankedMutex<LockRank::responses> waiting_mutex_;
  std::vector<Waiting> waiting_;  // of a service: responses
  std::atomic<std::uint64_t> readers_ever_{0};
  std::atomic<bool> is_made_{false};
  std::optional<TimedCall> look_again_;  // of a service: retries
  mutable PiMutex asking_mutex_;
  mutable ddsi_serdata* question_ = nullptr;  // the last probe; nullptr: confirmed
  TimePoint asks_until_{};
  std::atomic<std::size_t> known_before_{0};  // readers that matched before the probe
  PiMutex mutex_;                             // guards what follows
  std::uint64_t sequence_ = 0;                // of the last message sent by shared memory
  std::uint64_t readers_known_ = 0, before_newest_ = 0;
};

void LentBlock::recycle() noexcept {
  writer_->give_back(*this);
}

/// The publisher's handle of a CycloneWriter, which may live longer.
class WriterEnd final : public RemoteWriter {
 public:
  explicit WriterEnd(std::unique_ptr<CycloneWriter> writer) : writer_(std::move(writer)) {}
  ~WriterEnd() override {
    writer_->close();
    put_away(std::move(writer_));
  }
  std::size_t reader_count() const noexcept override { return writer_->reader_count(); }
  WallTime stamp() const noexcept override { return writer_->stamp(); }
  void write(const void* message, WallTime published) noexcept override {
    writer_->write(message, published);
  }
  MessageBlock* lend(const void* prototype) noexcept override { return writer_->lend(prototype); }
  void write_lent(MessageBlock& message, WallTime published) noexcept override {
    writer_->write_lent(message, published);
  }
  void assert_liveliness() noexcept override { writer_->assert_liveliness(); }
  bool wait_for_acks(Nanoseconds timeout) noexcept override {
    return writer_->wait_for_acks(timeout);
  }
  EndpointId gid() const noexcept override { return writer_->state().gid; }

 private:
  std::unique_ptr<CycloneWriter> writer_;
};

}  // namespace

std::unique_ptr<RemoteWriter> make_writer(CycloneParticipant& participant, const Endpoint& endpoint,
                                          std::shared_ptr<EndpointEvents> events) {
  return std::make_unique<WriterEnd>(
      std::make_unique<CycloneWriter>(participant, endpoint, std::move(events)));
}

}  // namespace takt
