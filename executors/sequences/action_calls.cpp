// Actions: goals, and how they end.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {
namespace {

constexpr std::size_t kMostGoals = 4;  // of a server, and of a client

ActionServerOptions server_options(const std::shared_ptr<CallbackGroup>& group) {
  return {.most_goals = kMostGoals,
          .result_timeout = 1s,
          .goal_group = group,
          .cancel_group = group,
          .result_group = group,
          .execute_group = group};
}

}  // namespace

void World::make_action_server() {
  const std::uint8_t mode = next() % 4;
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->action = "/" + name;
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
    const auto options = server_options(part->group->group);
    if (mode == 3) {
      part->action_server = create_action_server<Count>(
          *place.node, part->action, decide, may_cancel,
          [this, part](HeldGoal::Handle handle) -> Task<> {
            HeldGoal goal(handle, goals_[handle->goal().number]);
            const Inside inside = enter(part);
            act(part);
            return reach_goal(part, std::move(goal));
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
  const Nanoseconds timeout = next() % 2 == 0 ? 0ms : 1ms;
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
  const Inside inside = enter(server);
  if (mode == 0) held_.push_back(std::move(goal));
  if (mode == 1) end_goal(goal, GoalState::succeeded);
  act(server);
}

Task<> World::reach_goal(PartPtr server, HeldGoal goal) {
  co_await sleep_for(1ms);
  const Inside inside = enter(server);
  goal.handle->publish_feedback({1});
  end_goal(goal, goal.handle->is_canceling() ? GoalState::canceled : GoalState::succeeded);
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

void World::send_goal() {
  const PartPtr client = any_with(&Part::action_client);
  if (client == nullptr) return;
  const bool drops = next() % 4 == 0;
  const auto goal = std::make_shared<Goal>();
  goal->number = static_cast<int>(goals_.size());
  goal->client = client;
  for (const PartPtr& part : parts_) {
    if (part->action_server != nullptr && part->action == client->action) goal->server = part;
  }
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
    const bool went = result.state == GoalState::aborted && goal->is_without_server();
    if (result.state != GoalState::unknown && !went) {
      demand(goal->ended == result.state, "a goal ended for its client as it did not");
    }
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

// After a whole spin.
void World::check_goal(const Goal& goal) {
  const PartPtr server = goal.server.lock(), client = goal.client.lock();
  for (const PartPtr& end : {server, client}) {
    if (end == nullptr || !is_in_executor(*end) || end->has_thrown) return;
  }
  demand(goal.responses == 1, "a client got no answer about its goal");
  demand(goal.results == 1 || goal.handle == nullptr || !goal.ended,
         "a goal ended, and its client was not notified");
}

}  // namespace takt::sequences
