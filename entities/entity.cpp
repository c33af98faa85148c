// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/entity.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "takt/base/error.hpp"
#include "takt/base/held_locks.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/never_destroyed.hpp"

namespace takt {

// The entity owned a callback and its captures, which are user code.
Entity::~Entity() {
  detail::expect_no_lock("callback");
}

// The TLS model of the header must be repeated here, else each access in this file is a function
// call.
[[gnu::tls_model("initial-exec")]] thread_local constinit const Dispatch* Dispatch::current_ =
    nullptr;

Entity::Entity(EntityKind kind, std::string name, std::shared_ptr<CallbackGroup> group)
    : kind_(kind),
      name_(std::move(name)),
      group_(std::move(group)),
      id_([] {
        static std::atomic<std::uint64_t> last{0};
        return last.fetch_add(1) + 1;
      }()),
      mark_(path_mark(id_)) {
}

void Entity::set_parameters(const CallbackParameters& parameters) {
  parameters.check(period());
  parameters_ = parameters;
}

void Entity::join_chain(ChainStep step) {
  const std::lock_guard lock(ownership_mutex());
  if (owner_ != nullptr) {
    throw Error("'" + name_ + "' has an executor already",
                "declare chains before; in a file, give its callback group an executor");
  }
  chain_steps_.push_back(std::move(step));
}

const std::string& Entity::topic() const noexcept {
  static detail::NeverDestroyed<const std::string> none;
  return *none;
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

bool Entity::is_free() const noexcept {
  return owner_ == nullptr && std::all_of(earlier_owners_.begin(), earlier_owners_.end(),
                                          [](const Sink* sink) { return sink->is_detached(); });
}

// Another thread may be removing the entity with its node or group, or its callback may have
// removed it and still run. Both must have ended when this returns.
void Entity::leave_owner() noexcept {
  Sink* owner = nullptr;
  std::vector<Sink*> earlier;
  {
    const std::lock_guard lock(ownership_mutex());
    earlier = earlier_owners_;
    for (Sink* sink : earlier) sink->expect_wait();
    owner = std::exchange(owner_, nullptr);
    if (owner != nullptr) owner->expect_remove();
  }
  if (owner != nullptr) owner->remove();
  for (Sink* sink : earlier) sink->wait_for_removal();
}

PiMutex& ownership_mutex() noexcept {
  static detail::NeverDestroyed<PiMutex> mutex;
  return *mutex;
}

}  // namespace takt
