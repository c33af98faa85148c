// Callbacks that are coroutines.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {

void World::make_task() {
  const std::uint8_t what = next();
  const int topic = next() % 2;
  const bool is_timer = next() % 2 == 0;
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->is_managed = place.lifecycle != nullptr;
    const auto& group = part->group->group;
    // The callback may throw before it becomes a coroutine.
    const auto on_release = [this, part, what]() -> Task<> {
      ran(part);
      return task(part, what);
    };
    const auto on_message = [this, part, what](const Number&) -> Task<> {
      ran(part);
      return task(part, what);
    };
    if (is_timer) {
      part->timer = place.lifecycle != nullptr
                        ? place.lifecycle->create_timer(name, kPeriods[0], on_release, group)
                        : place.node->create_timer(name, kPeriods[0], on_release, group);
      return begin_phase(*part);
    }
    part->topic = topic;
    if (place.lifecycle != nullptr) {
      part->subscription =
          place.lifecycle->create_subscription<Number>(kTopics[topic], 2, on_message, group);
    } else {
      part->subscription =
          place.node->create_subscription<Number>(kTopics[topic], 2, on_message, group);
    }
  });
}

void World::make_receiver() {
  const int topic = next() % 2;
  make_part([&](Place& place, const PartPtr& part, const std::string&) {
    part->receiver = place.node->create_receiver<Number>(kTopics[topic], 2, part->group->group);
  });
}

// Makes one to three steps, in which it may wait. `part`: that of the callback.
Task<> World::task(PartPtr part, std::uint8_t what) {
  struct InTask {
    explicit InTask(Part& of) noexcept : part(of) { part.is_in_task = true; }
    ~InTask() {
      part.is_in_task = false;
      part.sleeps_until = kNever;
    }
    Part& part;
  } const in_task(*part);
  for (int left = 1 + what % 3; left > 0; --left) {
    what /= 4;
    // Where the step does not wait, the same execution goes on, whatever it did to its own part.
    const bool might_run = is_active(*part) && is_in_executor(*part);
    const bool has_waited = co_await step(part, what);
    const Inside inside = might_run || has_waited ? enter(part) : enter_group(part);
    --runs_;
    act(part);
  }
}

// Returns whether it has waited for certain.
Task<bool> World::step(PartPtr part, std::uint8_t what) {
  switch (what % 4) {
    case 0:
      co_await doze(part);
      co_return true;
    case 1:
      co_return co_await await_answer();
    case 2:
      co_await await_message(part);
      co_return false;  // a message may have been there
    default:
      if (next() % 2 == 0) {
        co_await batch();
        co_return true;
      }
      co_await await_goal(part);
      co_return false;  // there may be no client
  }
}

Task<> World::doze(PartPtr part) {
  const std::uint8_t how_long = next() % 8;
  const Nanoseconds duration = how_long < kDurations.size() ? kDurations[how_long] : 1ms;
  const TimePoint until = later(clock_.now(), duration);
  part->sleeps_until = until;
  if (next() % 2 == 0) {
    co_await sleep_for(duration);
  } else {
    co_await sleep_until(until);
  }
  demand(clock_.now() >= until, "a coroutine went on before it had slept enough");
  part->sleeps_until = kNever;
}

Task<bool> World::await_answer() {
  const PartPtr client = any_with(&Part::client);
  if (client == nullptr) co_return false;
  const auto call = begin_call(*client);
  call->is_awaited = true;
  // Removes the call wherever the coroutine waits when it is dropped.
  struct Ends {
    ~Ends() { std::erase(client->calls, call); }
    const PartPtr& client;
    const std::shared_ptr<Call>& call;
  };
  const Ends ends{client, call};
  const Twice::Request request{call->number};
  if (client->client->calls_in_flight() == client->client->qos().depth) co_return false;
  sent(client, call);
  const auto answer = co_await client->client->call(request);
  if (answer) {
    answered(client, *call, &*answer);
  } else {
    demand(client->is_dropped || std::min(call->deadline, call->lonely_end) <= clock_.now(),
           "an awaited call ended without an answer before its time");
  }
  co_return true;
}

Task<> World::await_message(PartPtr part) {
  const PartPtr receiver = any_with(&Part::receiver);
  if (receiver == nullptr) co_return;
  part->awaits = receiver;
  const auto message = co_await receiver->receiver->receive();
  part->awaits.reset();
  demand(static_cast<bool>(message) || receiver->is_dropped,
         "a coroutine went on without the message it awaited");
}

}  // namespace takt::sequences
