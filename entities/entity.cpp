// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/entity.hpp"

#include <mutex>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"

namespace takt {

thread_local constinit const Dispatch* Dispatch::current_ = nullptr;

Entity::Entity(EntityKind kind, std::string name, std::shared_ptr<CallbackGroup> group)
    : kind_(kind),
      name_(std::move(name)),
      group_(std::move(group)),
      id_([] {
        static std::atomic<std::uint64_t> last{0};
        return last.fetch_add(1) + 1;
      }()),
      mark_(way_mark(id_)) {
}

void Entity::set_parameters(const CallbackParameters& parameters) {
  parameters.check(period());
  parameters_ = parameters;
}

void Entity::join_chain(ChainStep step) {
  const std::lock_guard lock(ownership_mutex());
  if (owner_ != nullptr) {
    throw Error("'" + name_ + "' has an executor already", "declare chains before");
  }
  chain_steps_.push_back(std::move(step));
}

bool Entity::front(Arrival&) const noexcept {
  return false;
}

void Entity::detach() noexcept {
  sink_.store(nullptr);
  wait_for_readers();
}

void Entity::retire() noexcept {
  {
    const std::lock_guard lock(ownership_mutex());
    is_retired_ = true;
  }
  leave_owner();
}

// Another thread may be removing it, with its node or group: that has to end here too.
void Entity::leave_owner() noexcept {
  Sink* owner = nullptr;
  Sink* earlier = nullptr;
  {
    const std::lock_guard lock(ownership_mutex());
    owner = std::exchange(owner_, nullptr);
    if (owner != nullptr) {
      owner->expect_remove();
    } else if (earlier_owner_ != nullptr) {
      earlier = earlier_owner_;
      earlier->expect_wait();
    }
  }
  if (owner != nullptr) owner->remove();
  if (earlier != nullptr) earlier->wait_for_removal();
}

PiMutex& ownership_mutex() noexcept {
  static PiMutex mutex;
  return mutex;
}

}  // namespace takt
