// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/record.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/entities/wait_in_callback.hpp"
#include "takt/executors/engine/callbacks.hpp"
#include "takt/executors/engine/dispatcher.hpp"
#include "takt/nodes/callback_info.hpp"

namespace takt::detail {
CallbackRecord::CallbackRecord(Callbacks& owner, Dispatcher& by, std::shared_ptr<Entity> of,
                               const Node& its_node, const CallbackParameters& parameters)
    : Observed(std::move(of), its_node, parameters, by.workers().all().size(),
               by.observation().records_times()),
      dispatcher(by),
      callbacks(owner),
      takes_briefly(entity->takes_briefly()) {
}

void CallbackRecord::set(const CallbackSettings& now) noexcept {
  settings = now;
  workers.store(settings.workers);
  entity->set_most_releases(settings.releases);
  demoted_info = demoted(settings.info);
  is_checked = must_be_checked(settings);
  if (!is_checked) is_demoted = false;
  if (is_dropped()) supervision->forget_waiting();
  set_urgency();  // it may be waiting: then it goes back with the new urgency
}

void CallbackRecord::set_urgency() noexcept {
  const bool is_last = is_demoted || settings.serving != Serving::usual;
  info = is_last ? &demoted_info : &settings.info;
  deadline = is_last ? kNever : deadline_of(ready_time);
}

void CallbackRecord::own_entity() noexcept {
  entity->set_owner(this);
  begin_counting();
}

// ---- As a sink ----

void CallbackRecord::announce(const Arrival& arrival) noexcept {
  dispatcher.announce(*this, arrival);
}

bool CallbackRecord::takes_here() const noexcept {
  return Worker::is_only_one_of(dispatcher);
}

void CallbackRecord::release_changed() noexcept {
  if (dispatcher.ready().announce(*this, {})) dispatcher.workers().wake();
}

bool CallbackRecord::wants_time() const noexcept {
  return dispatcher.ready().exact_time();
}

void CallbackRecord::remove() noexcept {
  callbacks.remove({this}, entity->drop_wait());
}

void CallbackRecord::expect_remove() noexcept {
  expect_wait();
  entity->add_earlier_owner(*this);
}

void CallbackRecord::expect_wait() noexcept {
  callbacks.removals().expect();
  state.retain();
}

void CallbackRecord::wait_for_removal() noexcept {
  Removals& removals = callbacks.removals();
  wait_until_over();
  detach();
  state.release();
  removals.are_over(1);
}

// ---- The end of its life ----

void CallbackRecord::leave() noexcept {
  if (!state.is_over()) return;
  WaitInCallback::notify_progress();
  if (state.has_left()) state.release();
}

void CallbackRecord::remove_unpublished() noexcept {
  state.remove(is_announced);
  WaitInCallback::notify_progress();
}

// A callback that removes itself does not wait: the removal is complete when it returns. Of
// callbacks that remove each other, one must not wait, or none could return. While a thread waits
// inside a callback, it may be the only one that can install an update for which another thread
// waits: an update of its own executor, or of the executor of an outer callback.
bool CallbackRecord::wait_until_over(Nanoseconds at_most) const noexcept {
  if (state.is_over()) return true;
  const WaitInCallback wait(this, [](const void* record, const CallbackInfo* callback) {
    return static_cast<const CallbackRecord*>(record)->is_described_by(callback);
  });
  return wait.until([&] { return state.is_over() || (wait.is_for_itself() && state.is_removed()); },
                    at_most);
}

// A thread that is preempted here delays others only for that time.
void CallbackRecord::detach() noexcept {
  if (!state.begin_to_detach()) return state.wait_until_detached();
  entity->detach();
  end_counting();
  state.set_detached();
}

bool CallbackRecord::may_be_freed() noexcept {
  const std::lock_guard ownership(ownership_mutex());
  if (!state.is_unused()) return false;
  forget_earlier_owner();
  return true;
}

// ---- What it says ----

NamedCallback named(const CallbackRecord& record, const CallbackInfo& info) noexcept {
  return {record.supervision->node, record.supervision->callback, info};
}

CallbackSettings settings_of(const CallbackRecord& record, const Node& node) {
  CallbackSettings settings = record.wanted;
  const CallbackParameters parameters = node.callback_parameters(*record.entity);
  settings.overrun = parameters.overrun.value_or(OverrunPolicy::catch_up);
  settings.serving = parameters.serving.value_or(Serving::usual);
  settings.releases = static_cast<std::uint32_t>(parameters.releases.value_or(1));
  settings.info = callback_info(node, *record.entity, record.wanted.info);
  const NamedCallback callback = named(record, settings.info);
  try {
    if (const Rule* rule = record.dispatcher.rule()) settings.label = rule->label(callback);
    settings.workers = record.dispatcher.workers().that_may_take(callback);
  } catch (const Error&) {
    throw;
  } catch (...) {
    throw Error(fmt::format("the rule or the workers' policy of '{}/{}' throws: {}", record.node,
                            callback.callback, text_of(std::current_exception())),
                "let it throw takt::Error for a callback that it refuses, and nothing else");
  }
  return settings;
}

}  // namespace takt::detail
