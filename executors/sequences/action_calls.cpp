// Actions: goals, and how they end.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {
namespace {

ActionServerOptions server_options(const std::shared_ptr<CallbackGroup>& group,
                                   std::size_t most_goals, Nanoseconds result_timeout) {
  return {.most_goals = most_goals,
          .result_timeout = result_timeout,
          .goal_group = group,
          .cancel_group = group,
          .result_group = group,
          .execute_group = group};
}

}  // namespace

void World::make_action_server() {
  const std::uint8_t mode = next() % 5;
  const std::size_t most_goals = 1 + next() % 4;
  const Nanoseconds result_timeout = kDurations[next() % kDurations.size()];
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->action = "/" + name;
    part->result_timeout = result_timeout;
    const auto decide = [this, part](const GoalId&, const Count::Goal& goal) {
      const bool is_rejected = goal.number % 4 == 3;
      if (is_rejected) goals_[goal.number]->is_rejected = true;
      const Inside inside = enter(part);
      act(part);
      return is_rejected ? GoalResponse::reject : GoalResponse::accept_and_execute;
    };
    const auto may_cancel = [this, part](const HeldGoal::Handle& handle) {
      const Inside inside = enter(part);
      act(part);
      return handle->goal().number % 2 == 0 ? CancelResponse::accept : CancelResponse::reject;
    };
    const auto options = server_options(part->group->group, most_goals, result_timeout);
    if (mode >= 3) {
      part->action_server = create_action_server<Count>(
          *place.node, part->action, decide, may_cancel,
          [this, part, mode](HeldGoal::Handle handle) -> Task<> {
            HeldGoal goal(handle, goals_[handle->goal().number]);
            goal.goal->is_handled = true;
            const Inside inside = enter(part);
            act(part);
            return reach_goal(part, std::move(goal), /*lingers=*/mode == 4);
          },
          options);
    } else {
      part->action_server = create_action_server<Count>(
          *place.node, part->action, decide, may_cancel,
          [this, part, mode](HeldGoal::Handle handle) { accept_goal(part, mode, handle); },
          options);
    }
  });
}

void World::make_action_client() {
  const PartPtr server = any_with(&Part::action_server);
  const Nanoseconds timeout = next() % 2 == 0 ? 1ms : kDurations[next() % kDurations.size()];
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->action = server != nullptr ? server->action : "/" + name;
    part->action_client = create_action_client<Count>(
        *place.node, part->action,
        {.timeout = timeout, .most_goals = 2, .group = part->group->group});
  });
}

// ---- The server's side ----

bool Goal::is_without_server() const {
  const PartPtr part = server.lock();
  return part == nullptr || part->is_dropped;
}

void World::end_goal(HeldGoal& goal, GoalState state) {
  const GoalState before = goal.handle->state();
  const bool has_no_server = goal.goal->is_without_server();  // which has aborted it
  const bool fits = before == GoalState::canceling ||
                    (before == GoalState::executing && state != GoalState::canceled);
  bool has_ended = true;
  try {
    const Count::Result result{goal.goal->number};
    switch (state) {
      case GoalState::succeeded:
        goal.handle->succeed(result);
        break;
      case GoalState::aborted:
        goal.handle->abort(result);
        break;
      default:
        goal.handle->canceled(result);
    }
  } catch (const Error&) {
    has_ended = false;
  }
  demand(has_ended == (fits || has_no_server), "a goal ended that could not, or did not and could");
  if (!has_ended || has_no_server) return;
  demand(!goal.goal->ended, "a goal ended twice");
  goal.goal->ended = state;
}

void World::accept_goal(const PartPtr& server, std::uint8_t mode, HeldGoal::Handle handle) {
  HeldGoal goal(handle, goals_[handle->goal().number]);
  handle.reset();
  goal.goal->is_handled = true;
  const Inside inside = enter(server);
  if (mode == 0) held_.push_back(std::move(goal));
  if (mode == 1) end_goal(goal, GoalState::succeeded);
  act(server);
}

// `lingers`: the coroutine continues when the goal has ended.
Task<> World::reach_goal(PartPtr server, HeldGoal goal, bool lingers) {
  if (!lingers) co_await sleep_for(1ms);
  {
    const Inside inside = lingers ? enter_group(server) : enter(server);
    goal.handle->publish_feedback({1});
    end_goal(goal, goal.handle->is_canceling() ? GoalState::canceled : GoalState::succeeded);
    act(server);
  }
  if (!lingers) co_return;
  goal.handle.reset();
  co_await sleep_for(1ms);
  const Inside inside = enter(server);
  act(server);
}

void World::end_held_goal() {
  if (held_.empty()) return;
  const std::size_t place = next() % held_.size();
  const std::uint8_t what = next() % 5;
  if (what == 4) return held_[place].handle->publish_feedback({2});
  HeldGoal goal = std::move(held_[place]);
  held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(place));
  constexpr GoalState kEnds[] = {GoalState::succeeded, GoalState::aborted, GoalState::canceled};
  if (what != 3) end_goal(goal, kEnds[what]);
}

// ---- The client's side ----

std::shared_ptr<Goal> World::new_goal(const PartPtr& client) {
  auto goal = std::make_shared<Goal>();
  goal->number = static_cast<int>(goals_.size());
  goal->sent = clock_.now();
  goal->client = client;
  for (const PartPtr& part : parts_) {
    if (part->action_server != nullptr && part->action == client->action) goal->server = part;
  }
  return goal;
}

void World::check_result(const Goal& goal, GoalState state) {
  if (state == GoalState::unknown) return;
  if (state == GoalState::aborted && goal.is_without_server()) return;
  demand(goal.is_handled || goal.is_without_server(),
         "a goal was accepted, and never given to its server");
  demand(goal.ended == state, "a goal ended for its client as it did not");
}

void World::send_goal() {
  const PartPtr client = any_with(&Part::action_client);
  if (client == nullptr) return;
  const bool drops = next() % 4 == 0;
  const auto goal = new_goal(client);
  const auto accepted = [this, client, goal, drops](const auto& handle) {
    const Inside inside = enter(client);
    demand(++goal->responses == 1, "a client got two answers about a goal");
    demand(handle == nullptr || !goal->is_rejected, "a goal was accepted that was rejected");
    goal->handle = handle;
    if (drops) let_go(client);
    act(client);
  };
  const auto feedback = [this, client](const auto&, const Count::Feedback&) {
    const Inside inside = enter(client);
    act(client);
  };
  const auto ended = [this, client, goal](const auto&, const GoalResult<Count>& result) {
    const Inside inside = enter(client);
    demand(++goal->results == 1, "a goal had two results");
    demand(goal->responses == 1, "a goal had a result before it was accepted");
    check_result(*goal, result.state);
    act(client);
  };
  attempt([&] {
    client->action_client->async_send_goal({goal->number}, {accepted, feedback, ended});
    goals_.push_back(goal);
  });
}

void World::cancel_goal() {
  auto* const goal = any(goals_);
  if (goal == nullptr || (*goal)->handle == nullptr) return;
  const PartPtr client = (*goal)->client.lock();
  if (client == nullptr || client->action_client == nullptr) return;
  attempt([&] {
    client->action_client->async_cancel_goal((*goal)->handle, [this, client](const auto&) {
      const Inside inside = enter(client);
      act(client);
    });
  });
}

// Asks for the result of a goal once more.
void World::ask_result() {
  auto* const chosen = any(goals_);
  if (chosen == nullptr || (*chosen)->handle == nullptr) return;
  const auto goal = *chosen;
  const PartPtr client = goal->client.lock();
  if (client == nullptr || client->action_client == nullptr) return;
  attempt([&] {
    client->action_client->async_get_result(
        goal->handle, [this, client, goal](const auto&, const GoalResult<Count>& result) {
          const Inside inside = enter(client);
          const PartPtr server = goal->server.lock();
          const bool is_kept =
              server != nullptr && !server->is_dropped && is_for_ever(server->result_timeout);
          demand(!is_kept || result.state != GoalState::unknown,
                 "a result that is kept for ever was forgotten");
          act(client);
        });
  });
}

// In a coroutine: each response and result that it awaits comes, whatever becomes of the server.
Task<> World::await_goal(PartPtr part) {
  const PartPtr client = any_with(&Part::action_client);
  if (client == nullptr) co_return;
  const auto goal = new_goal(client);
  goals_.push_back(goal);
  goal->waiter = part;
  goal->is_awaited = true;
  struct Ends {
    ~Ends() { goal->waiter.reset(); }
    const std::shared_ptr<Goal>& goal;
  } const ends{goal};
  try {
    goal->handle = co_await client->action_client->send_goal({goal->number});
    ++goal->responses;
    if (goal->handle == nullptr || client->is_dropped) co_return;
    demand(!goal->is_rejected, "a goal was accepted that was rejected");
    const auto result = co_await client->action_client->result(goal->handle);
    ++goal->results;
    check_result(*goal, result.state);
  } catch (const Error&) {  // there is no place
  }
}

// After a much later spin: all that wait for a server that has gone have been notified.
void World::check_end(const Goal& goal, TimePoint begin) {
  if (!goal.is_without_server() || goal.sent > begin) return;
  if (goal.is_awaited) {
    const PartPtr waiter = goal.waiter.lock();
    demand(waiter == nullptr || !is_in_executor(*waiter) || !is_active(*waiter) || !is_served(goal),
           "a coroutine waits for a goal whose server has gone");
    return;
  }
  if (!is_served(goal)) return;
  demand(goal.responses == 1, "a client got no answer about a goal whose server has gone");
  demand(goal.results == 1 || goal.handle == nullptr, "a goal outlives its server");
}

// Whether the goal's client is in an executor.
bool World::is_served(const Goal& goal) {
  const PartPtr client = goal.client.lock();
  return client != nullptr && is_in_executor(*client);
}

// After a spin that ran to its end.
void World::check_goal(const Goal& goal) {
  if (goal.is_awaited) return;
  const PartPtr server = goal.server.lock(), client = goal.client.lock();
  for (const PartPtr& end : {server, client}) {
    if (end == nullptr || !is_in_executor(*end)) return;
  }
  demand(goal.responses == 1, "a client got no answer about its goal");
  demand(goal.results == 1 || goal.handle == nullptr || !goal.ended,
         "a goal ended, and its client was not notified");
}

}  // namespace takt::sequences
