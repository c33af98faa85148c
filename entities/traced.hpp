// What entities and publishers tell to tracepoints.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_TRACED_HPP_
#define TAKT_ENTITIES_TRACED_HPP_

#include <cstddef>
#include <string>

#include "takt/base/probes.hpp"
#include "takt/base/tracepoints.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_INTERNAL takt {

/// While it lives, the callback runs. Real-time: as Tracepoints.
class TracedCallback {
 public:
  TracedCallback(const Entity& entity, const Slot& slot) noexcept
      : points_(tracepoints()), entity_(&entity), callback_(&entity) {
    TAKT_PROBE(callback_start, &entity, entity.name().c_str());
    if (points_ != nullptr && points_->records_callbacks()) [[unlikely]]
      begin(slot);
  }
  ~TracedCallback() {
    TAKT_PROBE(callback_end, entity_, entity_->name().c_str());
    if (points_ != nullptr) [[unlikely]]
      points_->callback_end(callback_);
  }
  TracedCallback(const TracedCallback&) = delete;
  TracedCallback& operator=(const TracedCallback&) = delete;

 private:
  [[gnu::cold, gnu::noinline]] void begin(const Slot& slot) noexcept;

  const Tracepoints* const points_;
  const Entity* const entity_;
  const void* callback_;  // its handle
};

/// An entity was made. `node`: the handle of its node, whose full name is `node_name`.
void trace_made(const Entity& entity, const void* node, const std::string& node_name);

/// An executor with so many threads was made; a group with callbacks was added to it.
void trace_executor_made(const void* executor, std::size_t threads);
void trace_group_added(const void* executor, const CallbackGroup& group);

}  // namespace takt

#endif  // TAKT_ENTITIES_TRACED_HPP_
