// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/entity.hpp"

#include <mutex>

#include "takt/base/read_section.hpp"

namespace takt {

thread_local constinit const Dispatch* Dispatch::current_ = nullptr;

Entity::Entity(EntityKind kind, std::string name, std::shared_ptr<CallbackGroup> group)
    : kind_(kind), name_(std::move(name)), group_(std::move(group)) {}

bool Entity::front(Arrival&) const noexcept { return false; }

void Entity::detach() noexcept {
  sink_.store(nullptr);
  wait_for_readers();
}

void Entity::retire() noexcept {
  Sink* owner = nullptr;
  {
    const std::lock_guard lock(ownership_mutex());
    owner = std::exchange(owner_, nullptr);
    if (owner != nullptr) owner->expect_remove();
  }
  if (owner != nullptr) owner->remove();
}

PiMutex& ownership_mutex() noexcept {
  static PiMutex mutex;
  return mutex;
}

}  // namespace takt
