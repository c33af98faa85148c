// The calls of the sequences from four threads at once, on an executor that spins. Each thread's
// calls come from a fixed seed; what the threads do to each other is up to the machine, so this is
// for crashes, sanitizers, lost exclusion and callbacks that run when they must not.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <future>
#include <mutex>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "takt/executors/executor.hpp"
#include "takt/executors/sequences/sequence_types.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"

namespace takt::sequences {
namespace {

using namespace std::chrono_literals;

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kCallsOfAThread = 150;
#else
constexpr int kCallsOfAThread = 1000;
#endif
constexpr int kThreads = 4, kCallsBefore = 20;
constexpr std::size_t kMostOwned = 16;
constexpr const char* kTopics[] = {"/left", "/right"};

/// The first promise that was broken.
std::atomic<const char*> broken{nullptr};
void demand(bool holds, const char* promise) noexcept {
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

/// What all threads have.
struct Common {
  std::unique_ptr<Executor> executor;
  Place place{std::make_shared<Node>("common")};
  std::shared_ptr<LifecycleNode> lifecycle = std::make_shared<LifecycleNode>("managed");
  Place managed{lifecycle};
  std::array<std::shared_ptr<Publisher<Number>>, 2> publishers{
      place.node->create_publisher<Number>(kTopics[0], 4),
      place.node->create_publisher<Number>(kTopics[1], 4)};
};

/// One of the four threads.
class Actor {
 public:
  Actor(Common& common, unsigned number)
      : common_(common),
        own_(std::make_shared<Node>("own_" + std::to_string(number))),
        random_(number),
        number_(number) {}
  void act(int calls) {
    for (int i = 0; i < calls && broken == nullptr; ++i) {
      try {
        call(pick(18));
      } catch (const Error&) {  // what cannot be is refused
      }
    }
  }
  void let_go_of_all() {
    while (!owned_.empty()) drop();
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
            goal->publish_feedback({1});
            if (goal->goal().number % 4 == 1) co_return;  // aborted
            // A cancel may come between.
            goal->succeed({goal->goal().number});
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
  void drop() {
    std::swap(owned_[pick(owned_.size())], owned_.back());
    owned_.back().let_go();
    owned_.pop_back();
  }

  // ---- What is there ----

  // Nobody else touches this node, so it is known where it is.
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
};

/// A registered name, and what runs has a thread for.
struct Kind {
  std::string type;
  Isolation per = Isolation::node;
};

class FourThreads : public testing::TestWithParam<Kind> {
 protected:
  const ExecutorTraits traits_ = executors().traits(GetParam().type);
};

TEST_P(FourThreads, MayCallWhateverOneMay) {
  broken = nullptr;
  Logger::instance().set_level(LogLevel::error);  // of goals that nobody ends
  std::vector<std::weak_ptr<Probe>> probes;
  {
    Common common;
    ExecutorOptions options{.per = GetParam().per};
    options.threads.resize(std::min<std::size_t>(traits_.max_threads, 2));
    common.executor = executors().make(GetParam().type, options);
    common.executor->add_node(common.place.node);
    common.executor->add_node(common.managed.node);
    std::vector<std::unique_ptr<Actor>> actors;
    for (unsigned i = 0; i < kThreads; ++i) {
      actors.push_back(std::make_unique<Actor>(common, i));
      actors.back()->act(kCallsBefore);
    }
    std::atomic<bool> is_over{false};
    std::thread spinner([&] {
      while (!is_over) common.executor->spin([](const FailedCallback&) { return true; });
    });
    std::vector<std::thread> threads;
    for (const auto& actor : actors) {
      threads.emplace_back([&] { actor->act(kCallsOfAThread), actor->let_go_of_all(); });
    }
    for (std::thread& thread : threads) thread.join();
    is_over = true;
    common.executor->cancel();
    spinner.join();
    for (const auto& actor : actors) {
      probes.insert(probes.end(), actor->probes.begin(), actor->probes.end());
    }
    common.executor.reset();
  }
  EXPECT_STREQ(broken.load(), nullptr);
  for (const auto& probe : probes) ASSERT_TRUE(probe.expired());
}

// The handle's owner found that the entity had no executor any more, and did not wait.
TEST_P(FourThreads, ADropWaitsForTheCallbackThatARemovalWaitsForAlready) {
  if (traits_.frozen) GTEST_SKIP() << "it lets nothing go";
  const auto executor = executors().make(GetParam().type, {.per = GetParam().per});
  const auto node = std::make_shared<Node>("node");
  std::promise<void> is_inside, may_leave;
  std::atomic<bool> has_left{false}, has_dropped{false}, was_inside{false};
  auto guard = node->create_guard_condition("guard", [&] {
    is_inside.set_value();
    may_leave.get_future().wait();
    has_left = true;
  });
  const std::shared_ptr<Entity> entity = node->find_entity("guard");
  executor->add_node(node);
  std::thread spinner([&] { executor->spin(); });
  guard->trigger();
  is_inside.get_future().wait();
  std::thread remover([&] { executor->remove_node(node); });
  const auto is_owned = [&] {
    const std::lock_guard lock(ownership_mutex());
    return entity->owner() != nullptr;
  };
  while (is_owned()) std::this_thread::yield();
  std::thread dropper([&] {
    guard.reset();
    was_inside = !has_left;
    has_dropped = true;
  });
  // Time in which it could show that it does not wait.
  for (int i = 0; i < 100 && !has_dropped; ++i) std::this_thread::yield();
  may_leave.set_value();
  dropper.join();
  remover.join();
  executor->cancel();
  spinner.join();
  EXPECT_FALSE(was_inside);
}

std::vector<Kind> every_executor() {
  std::vector<Kind> kinds;
  for (const std::string& name : executors().names()) {
    kinds.push_back({name});
    if (executors().traits(name).isolates) kinds.push_back({name, Isolation::group});
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(Sequences, FourThreads, testing::ValuesIn(every_executor()),
                         [](const auto& kind) {
                           return kind.param.type +
                                  (kind.param.per == Isolation::group ? "_per_group" : "");
                         });

}  // namespace
}  // namespace takt::sequences
