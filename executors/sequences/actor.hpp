// One of the threads that make the calls of the sequences at once.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_ACTOR_HPP_
#define TAKT_EXECUTORS_SEQUENCES_ACTOR_HPP_

#include <array>
#include <atomic>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "takt/executors/executor.hpp"
#include "takt/executors/sequences/sequence_types.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"

namespace takt::sequences::threads {

using namespace std::chrono_literals;

inline constexpr std::size_t kMostOwned = 16;
inline constexpr const char* kTopics[] = {"/left", "/right"};

/// The first promise that was broken.
inline std::atomic<const char*> broken{nullptr};
inline void demand(bool holds, const char* promise) noexcept {
  if (!holds) broken = promise;
}

struct Shared {  // a group, with how many are in its callbacks
  std::shared_ptr<CallbackGroup> group;
  std::atomic<int> inside{0};
};

/// What a callback knows of itself.
struct Probe {
  std::shared_ptr<Shared> group;
  std::shared_ptr<std::atomic<bool>> may_run;  // its node is in the executor
  std::atomic<bool> is_gone{false};            // its handle

  void run() {
    demand(!is_gone, "a callback ran after its handle was dropped");
    demand(*may_run, "a callback ran after its node was removed");
    const bool is_exclusive = group->group->type() == CallbackGroupType::MutuallyExclusive;
    demand(group->inside.fetch_add(1) == 0 || !is_exclusive, "callbacks of a group ran together");
    group->inside.fetch_sub(1);
  }
};
using ProbePtr = std::shared_ptr<Probe>;

/// An entity that a thread has made. One of the handles is there.
struct Owned {
  ProbePtr probe;
  std::shared_ptr<Timer> timer;
  std::shared_ptr<SubscriptionBase> subscription;
  std::shared_ptr<GuardCondition> guard;
  std::shared_ptr<Service<Twice>> service;
  std::shared_ptr<Client<Twice>> client;
  std::shared_ptr<ActionServer<Count>> server;
  std::shared_ptr<ActionClient<Count>> goals;

  void let_go() {
    timer.reset(), subscription.reset(), guard.reset(), service.reset();
    client.reset(), server.reset(), goals.reset();
    probe->is_gone = true;
  }
};

/// A node with its groups.
struct Place {
  explicit Place(std::shared_ptr<Node> made) : node(std::move(made)) {
    node->declare_parameter("value", 0);
    refuses = node->add_on_set_parameters_callback([](const Parameters& values) {
      return SetParametersResult{std::get<std::int64_t>(values.at("value")) % 2 == 0, "odd"};
    });
    add(node->default_callback_group());
    add(node->create_callback_group("exclusive", CallbackGroupType::MutuallyExclusive));
    add(node->create_callback_group("reentrant", CallbackGroupType::Reentrant));
  }
  void add(std::shared_ptr<CallbackGroup> group) {
    groups.push_back(std::make_shared<Shared>());
    groups.back()->group = std::move(group);
  }

  std::shared_ptr<Node> node;
  std::vector<std::shared_ptr<Shared>> groups;
  std::shared_ptr<std::atomic<bool>> may_run = std::make_shared<std::atomic<bool>>(true);
  OnSetParametersHandle refuses;
};

/// Owns a client, whose callback owns the robot (a reference cycle).
struct Robot {
  std::shared_ptr<ActionClient<Count>> client;
};

/// What all threads have.
struct Common {
  std::unique_ptr<Executor> executor;
  Place place{std::make_shared<Node>("common")};
  std::shared_ptr<LifecycleNode> lifecycle = std::make_shared<LifecycleNode>("managed");
  Place managed{lifecycle};
  std::array<std::shared_ptr<Publisher<Number>>, 2> publishers{
      place.node->create_publisher<Number>(kTopics[0], 4),
      place.node->create_publisher<Number>(kTopics[1], 4)};
  // The event is in a reentrant group and slow, so that a second worker calls it meanwhile.
  std::atomic<std::uint64_t> reported{0};
  std::shared_ptr<Entity> event = place.node->create_qos_event<MatchedStatus>(
      *publishers[0],
      [this](const MatchedStatus& status) {
        reported += status.total_count_change;
        std::this_thread::sleep_for(50us);
      },
      place.groups.back()->group);
};

/// One of the four threads.
class Actor {
 public:
  Actor(Common& common, unsigned number, unsigned seed)
      : common_(common),
        own_(std::make_shared<Node>("own_" + std::to_string(number))),
        random_(seed),
        number_(number) {}
  void act(int calls) {
    for (int i = 0; i < calls && broken == nullptr; ++i) {
      try {
        call(pick(20));
      } catch (const Error&) {  // an impossible call is refused
      }
    }
  }
  void let_go_of_all() {
    while (!owned_.empty()) drop();
    for (const auto& weak : robots_) {
      if (const auto robot = weak.lock()) robot->client.reset();  // its goals may never end
    }
  }
  std::vector<std::weak_ptr<Probe>> probes;

 private:
  unsigned pick(std::size_t below) { return static_cast<unsigned>(random_() % below); }
  std::string new_name() { return fmt::format("e{}_{}", number_, ++named_); }

  void call(unsigned what) {
    switch (what) {
      case 0:
      case 1:
        return make_simple();
      case 2:
        return make_service();
      case 3:
        return make_task();
      case 4:
        return make_action();
      case 5:
        return make_managed();
      case 6:
      case 7:
        if (!owned_.empty()) drop();
        return;
      case 8:
        return add_or_remove_own();
      case 9:
        return add_or_remove_common();
      case 10:
        return set_parameters();
      case 11:
        return request_transition();
      case 12:
        return common_.executor->release_timers(pick(3) != 0);
      case 13:
        if (pick(8) == 0) common_.executor->cancel();
        return;
      case 14:
        return send_out_robot();
      case 15:
        return match_often();
      default:
        return use();
    }
  }

  // ---- Making and dropping ----

  /// `make(place, owned, group)` gives it its handle.
  template <class Make>
  void make(Place& place, Make&& make_it) {
    if (owned_.size() == kMostOwned) drop();
    Owned owned;
    owned.probe = std::make_shared<Probe>();
    owned.probe->group = place.groups[pick(place.groups.size())];
    owned.probe->may_run = place.may_run;
    probes.push_back(owned.probe);
    make_it(*place.node, owned, owned.probe->group->group);
    owned_.push_back(std::move(owned));
  }
  Place& any_place() { return pick(2) == 0 ? own_ : common_.place; }

  void make_simple() {
    const unsigned kind = pick(3), topic = pick(2);
    make(any_place(), [&](Node& node, Owned& owned, const auto& group) {
      const auto run = [probe = owned.probe] { probe->run(); };
      const auto receive = [probe = owned.probe](const Number&) { probe->run(); };
      if (kind == 0) owned.timer = node.create_timer(new_name(), 200us, run, group);
      if (kind == 1) owned.guard = node.create_guard_condition(new_name(), run, group);
      if (kind != 2) return;
      owned.subscription = node.create_subscription<Number>(kTopics[topic], 2, receive, group);
    });
  }
  void make_service() {
    const bool is_client = pick(2) == 0;
    make(any_place(), [&](Node& node, Owned& owned, const auto& group) {
      if (is_client) {
        owned.client =
            node.create_client<Twice>("/twice", {.calls_in_flight = 4, .timeout = 1ms}, group);
        return;
      }
      owned.service = node.create_service<Twice>(
          "/twice",
          [probe = owned.probe](const Twice::Request& request, Twice::Response& response) {
            probe->run();
            response.value = 2 * request.value;
          },
          group);
    });
  }
  void make_task() {
    const unsigned kind = pick(2), topic = pick(2);
    make(any_place(), [&](Node& node, Owned& owned, const auto& group) {
      const auto client = std::shared_ptr<Client<Twice>>(
          node.create_client<Twice>("/twice", {.calls_in_flight = 4, .timeout = 1ms}, group));
      // The lambda keeps the client, and goes with its entity.
      const auto work = [probe = owned.probe, client]() -> Task<> {
        probe->run();
        co_await sleep_for(100us);
        probe->run();
        const Twice::Request request{1};
        co_await client->call(request);
        probe->run();
      };
      if (kind == 0) {
        owned.timer = node.create_timer(new_name(), 500us, work, group);
      } else {
        owned.subscription = node.create_subscription<Number>(
            kTopics[topic], 2, [work](const Number&) -> Task<> { co_await work(); }, group);
      }
    });
  }
  void make_action() {
    const bool is_client = pick(2) == 0;
    make(any_place(), [&](Node& node, Owned& owned, const auto& group) {
      const ProbePtr probe = owned.probe;
      if (is_client) {
        owned.goals = create_action_client<Count>(
            node, "/count", {.timeout = 1ms, .most_goals = 2, .group = group});
        return;
      }
      owned.server = create_action_server<Count>(
          node, "/count",
          [probe](const GoalId&, const Count::Goal& goal) {
            probe->run();
            return goal.number % 4 == 0 ? GoalResponse::reject : GoalResponse::accept_and_execute;
          },
          [probe](const auto&) {
            probe->run();
            return CancelResponse::accept;
          },
          [probe](std::shared_ptr<ServerGoalHandle<Count>> goal) -> Task<> {
            probe->run();
            co_await sleep_for(100us);
            probe->run();
            for (int i = 0; i < 5; ++i) goal->publish_feedback({i});
            if (goal->goal().number % 4 == 1) co_return;  // aborted
            // A cancel may arrive here.
            goal->succeed({goal->goal().number});
            for (int i = 0; i < 5; ++i) goal->publish_feedback({i});
          },
          {.goal_group = group,
           .cancel_group = group,
           .result_group = group,
           .execute_group = group});
    });
  }
  void make_managed() {
    const bool is_timer = pick(2) == 0;
    make(common_.managed, [&](Node&, Owned& owned, const auto& group) {
      const auto run = [probe = owned.probe] { probe->run(); };
      if (is_timer) {
        owned.timer = common_.lifecycle->create_timer(new_name(), 200us, run, group);
      } else {
        owned.subscription = common_.lifecycle->create_subscription<Number>(
            kTopics[0], 2, [run](const Number&) { run(); }, group);
      }
    });
  }
  // Makes the matched event fire as often as possible.
  void match_often() {
    for (int i = 0; i < 10; ++i) {
      (void)own_.node->create_subscription<Number>(kTopics[0], 1, [](const Number&) {});
    }
  }
  // The feedback callback has the last pointer to the robot, and so to the client.
  void send_out_robot() {
    const auto& group = common_.place.groups[pick(common_.place.groups.size())]->group;
    const auto robot = std::make_shared<Robot>();
    robot->client = create_action_client<Count>(*common_.place.node, "/count", {.group = group});
    robot->client->async_send_goal({2}, {.response = [](const auto&) {},
                                         .feedback = [robot](const auto&, const auto&) {},
                                         .result = [](const auto&, const auto&) {}});
    std::erase_if(robots_, [](const auto& weak) { return weak.expired(); });
    robots_.push_back(robot);
  }
  void drop() {
    std::swap(owned_[pick(owned_.size())], owned_.back());
    owned_.back().let_go();
    owned_.pop_back();
  }

  // ---- What is there ----

  // Only this thread uses the node, so it knows whether the node is in the executor.
  void add_or_remove_own() {
    if (!is_added_) {
      *own_.may_run = true;
      is_added_ = true;  // also when it is refused: then nothing runs
      common_.executor->add_node(own_.node);
    } else {
      common_.executor->remove_node(own_.node);
      *own_.may_run = false;
      is_added_ = false;
    }
  }
  void add_or_remove_common() {
    Place& place = pick(2) == 0 ? common_.place : common_.managed;
    const auto& group = place.groups[pick(place.groups.size())]->group;
    switch (pick(4)) {
      case 0:
        return common_.executor->add_node(place.node);
      case 1:
        return common_.executor->remove_node(place.node);
      case 2:
        return common_.executor->add_callback_group(group, place.node);
      default:
        return common_.executor->remove_callback_group(group, place.node);
    }
  }
  void set_parameters() {
    Place& place = any_place();
    const std::int64_t value = pick(10);
    const bool is_set = place.node->set_parameters_atomically({{"value", value}}).successful;
    demand(is_set == (value % 2 == 0), "a parameter was set that was refused, or was not");
    CallbackParameters parameters;
    parameters.priority = static_cast<int>(pick(4));
    place.node->set_callback_parameters({.callback_groups = {{"exclusive", parameters}}});
  }
  void request_transition() {
    constexpr const char* kWays[] = {"configure", "activate", "deactivate", "cleanup"};
    common_.lifecycle->trigger_transition(kWays[pick(std::size(kWays))]);
  }
  void use() {
    common_.publishers[pick(2)]->publish(Number{1});
    if (owned_.empty()) return;
    Owned& owned = owned_[pick(owned_.size())];
    const ProbePtr probe = owned.probe;
    if (owned.guard) owned.guard->trigger();
    if (owned.timer && pick(2) == 0) {
      owned.timer->cancel();
    } else if (owned.timer) {
      owned.timer->reset();
    }
    if (owned.client) {
      owned.client->async_send_request({1}, [probe](const Twice::Response*) { probe->run(); });
    }
    if (!owned.goals) return;
    owned.goals->async_send_goal({static_cast<int>(pick(8))},
                                 {.response = [probe](const auto&) { probe->run(); },
                                  .feedback = [probe](const auto&, const auto&) { probe->run(); },
                                  .result = [probe](const auto&, const auto&) { probe->run(); }});
    if (pick(2) == 0) owned.goals->async_cancel_all_goals([probe](const auto&) { probe->run(); });
  }

  Common& common_;
  Place own_;
  bool is_added_ = false;
  std::mt19937 random_;
  const unsigned number_;
  int named_ = 0;
  std::vector<Owned> owned_;
  std::vector<std::weak_ptr<Robot>> robots_;
};

}  // namespace takt::sequences::threads

#endif  // TAKT_EXECUTORS_SEQUENCES_ACTOR_HPP_
