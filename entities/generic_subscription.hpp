// Receives encoded messages of a type that is given by its name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_GENERIC_SUBSCRIPTION_HPP_
#define TAKT_ENTITIES_GENERIC_SUBSCRIPTION_HPP_

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "takt/base/visibility.hpp"
#include "takt/entities/subscription.hpp"

namespace TAKT_PUBLIC takt {

/// A message as it is on the wire, CDR with its header, and when it was published. The bytes are
/// there until the callback returns.
using SerializedCallback = std::function<void(std::span<const std::byte>, const MessageInfo&)>;

/// A subscription whose callback gets bytes. From other processes they come as they are; what was
/// published in this process is encoded on the thread that runs the callback, so that its publisher
/// does no more than for any other reader.
///
/// Thread safety: as Subscription.
/// Real-time: as Subscription; encoding allocates until a thread has seen its largest message.
class GenericSubscription final : public SubscriptionBase {
 public:
  GenericSubscription(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
                      const Endpoint& endpoint, SerializedCallback callback,
                      const std::shared_ptr<Participant>& participant)
      : SubscriptionBase(EntityKind::subscription, name, group, endpoint, participant, {}),
        callback_(std::move(callback)) {}

  const std::string& type_name() const noexcept { return endpoint().type->name; }

  using SubscriptionBase::take;
  bool take(Slot& slot) noexcept override;
  void execute(Slot& slot) override;

 private:
  const SerializedCallback callback_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_GENERIC_SUBSCRIPTION_HPP_
