// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/publisher.hpp"

#include "takt/base/error.hpp"
#include "takt/entities/staged_outputs.hpp"

namespace takt {

namespace {

// How many messages are stored for late joiners, and so are not in transit.
std::size_t kept(const QoS& qos) noexcept {
  return qos.durability == Durability::transient_local ? qos.depth : 0;
}

// How many messages of the user's, or copies of them, can be in transit without the heap.
std::size_t in_transit(const QoS& qos) noexcept {
  return qos.depth + 16 + kept(qos);
}

}  // namespace

PublisherBase::PublisherBase(const Endpoint& endpoint, Clock& clock, Nanoseconds expected_period,
                             const std::shared_ptr<Participant>& participant,
                             const MessageMaker& maker, std::size_t loans, const void* prototype)
    : writer_(endpoint, clock),
      remote_(participant != nullptr
                  ? participant->create_writer(writer_.endpoint(), writer_.events())
                  : nullptr),
      expected_period_(expected_period),
      wrappers_(Pool<OwnedBlock>::create(in_transit(qos()))),
      has_loans_(loans != 0),
      loans_(has_loans_ ? make_loans(loans + kept(qos()), maker, prototype)
                        : make_loans_by_need(most_in_advance(in_transit(qos()), maker.layout.bytes),
                                             maker)),
      prototype_(remote_ != nullptr && has_loans() ? make_loan(maker, prototype) : nullptr) {
}

PublisherBase::~PublisherBase() {
  StagedOutputs::forget(writer_);
}

void PublisherBase::trace_made(const void* node) const {
  const Tracepoints* const points = tracepoints();
  if (points == nullptr) return;
  if (remote_ != nullptr) points->rmw_publisher_init(this, remote_->gid().data());
  points->rcl_publisher_init(this, node, this, topic().c_str(), qos().depth);
}

void PublisherBase::trace(const Tracepoints& points, const void* message,
                          PublishTime& published) const noexcept {
  if (writer_.reader_count() != 0) {
    points.rclcpp_intra_publish(this, message);
    writer_.trace_enqueue(points, message);
  }
  if (remote_ == nullptr || remote_->reader_count() == 0) return;
  if (published.far == WallTime{}) published.far = WallTime::clock::now();
  points.rclcpp_publish(message);
  points.rcl_publish(this, message);
  const std::int64_t time = Nanoseconds(published.far.time_since_epoch()).count();
  points.dds_write(message);
  points.dds_bind_addr_to_stamp(message, static_cast<std::uint64_t>(time));
  points.rmw_publish(this, message, time);
}

bool PublisherBase::is_for_outside_only() const noexcept {
  const Dispatch* dispatch = Dispatch::current();
  return writer_.reader_count() == 0 && (dispatch == nullptr || dispatch->outputs == nullptr);
}

OwnedBlock& PublisherBase::wrapper() {
  if (OwnedBlock* block = wrappers_->acquire()) return *block;
  auto* const block = new OwnedBlock;
  block->from_heap = true;
  return *block;
}

void PublisherBase::refuse_null() const {
  throw Error("a null message was published on '" + topic() + "'");
}

void PublisherBase::refuse_loan() const {
  throw Error("publisher of '" + topic() + "' has no messages to lend",
              "give PublisherOptions::loans when you create it");
}

}  // namespace takt
