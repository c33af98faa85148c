// SPDX-License-Identifier: Apache-2.0
#include "own_calls.hpp"

#include <algorithm>
#include <future>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "takt/executors/sequences/sequence_types.hpp"

namespace rclcpp {
namespace {

using namespace std::chrono_literals;
using takt::sequences::Twice;

constexpr auto kPatience = std::chrono::seconds(20);

std::shared_ptr<Node> make_node(const Context::SharedPtr& context) {
  return std::make_shared<Node>(
      "own", NodeOptions().context(context).enable_rosout(false).start_parameter_services(false));
}
ExecutorOptions of(const Context::SharedPtr& context) {
  ExecutorOptions options;
  options.context = context;
  return options;
}

}  // namespace

const char* shut_down(const NextByte& next) {
  const auto context = std::make_shared<Context>();
  context->enter_container({});
  struct Callback {
    OnShutdownCallbackHandle handle;
    bool is_removed = false;
    int calls = 0;
  };
  std::vector<Callback> callbacks(next() % 5);
  std::atomic<const char*> broken{nullptr};
  for (Callback& callback : callbacks) {
    // Which callback this one removes; if there are not as many, it shuts down instead.
    const std::size_t other = next() % 8;
    const bool is_slow = next() % 4 == 0;  // so that other threads shut down meanwhile
    callback.handle = context->add_on_shutdown_callback([&, other, is_slow] {
      if (is_slow) std::this_thread::sleep_for(500us);
      ++callback.calls;
      if (callback.is_removed) broken = "a callback of shutdown was called after its removal";
      if (other >= callbacks.size()) return void(context->shutdown("callback"));
      if (context->remove_on_shutdown_callback(callbacks[other].handle)) {
        callbacks[other].is_removed = true;
      }
    });
  }
  std::vector<std::thread> threads;
  for (int others = next() % 3; others > 0; --others) {
    threads.emplace_back([&] {
      context->shutdown("thread");
      for (const Callback& callback : callbacks) {
        if (callback.calls == 0 && !callback.is_removed) {
          broken = "a thread returned from shutdown before all callbacks had";
        }
      }
    });
  }
  context->shutdown("main");
  for (std::thread& thread : threads) thread.join();
  for (const Callback& callback : callbacks) {
    if (callback.calls > 1) broken = "a callback of shutdown was called twice";
  }
  return broken;
}

const char* spin_a_node(const Context::SharedPtr& context, const NextByte& next) {
  const auto node = make_node(context);
  executors::SingleThreadedExecutor executor(of(context)), other(of(context));
  const std::uint8_t what = next() % 5, way = next() % 3;
  bool has_run = false, has_thrown = false;
  const auto timer = node->create_wall_timer(1ns, [&](TimerBase& self) {
    self.cancel();
    has_run = true;
    if (what == 1 || what == 2) executor.remove_node(node);
    if (what == 2) other.add_node(node);
    if (what == 3) executor.cancel();
    if (what == 4) throw std::domain_error("of the callback");
  });
  try {
    if (way == 0) {
      executor.spin_node_once(node, kPatience);
    } else if (way == 1) {
      executor.spin_node_some(node);
    } else {
      std::promise<void> never;
      executors::spin_node_until_future_complete(executor, node, never.get_future().share(), 1ms);
    }
  } catch (const std::domain_error&) {
    has_thrown = true;
  }
  if (!has_run) return "a timer that was due did not run";
  if (has_thrown != (what == 4)) return "an exception of a callback was lost";
  try {
    executor.remove_node(node);
    return "a node stayed in the executor that had spun it";
  } catch (const std::runtime_error&) {
  }
  if (what == 2) other.remove_node(node);
  return nullptr;
}

const char* prune_requests(const Context::SharedPtr& context, const NextByte& next) {
  const auto node = make_node(context);
  const auto client = node->create_client<Twice>("nobody");
  std::vector<std::chrono::system_clock::time_point> times;
  const std::size_t count = next() % 6;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(std::chrono::system_clock::now());
    client->async_send_request(std::make_shared<Twice::Request>());
    const auto sent = std::chrono::system_clock::now();
    while (std::chrono::system_clock::now() <= sent) {  // so that the next one is later
    }
  }
  std::size_t left = count;
  for (int prunings = next() % 4; prunings > 0 && count != 0; --prunings) {
    const std::size_t first = next() % count;  // the first that is kept
    const std::size_t pruned = client->prune_requests_older_than(times[first]);
    const std::size_t meant = left - std::min(left, count - first);
    if (pruned != meant) return "pruning requests by their time took others";
    left -= meant;
  }
  return client->prune_pending_requests() == left ? nullptr : "a request was forgotten";
}

const char* change_a_wait_set(const Context::SharedPtr& context, const NextByte& next) {
  const auto node = make_node(context);
  const auto group = node->create_callback_group(CallbackGroupType::Reentrant, false);
  const auto kept = std::make_shared<GuardCondition>(context);
  ThreadSafeWaitSet set({}, {kept}, {}, {}, {}, {}, context);
  // Longer than the test waits: at its timeout, a wait would find ready entities without being
  // woken.
  auto waits = std::async(std::launch::async, [&] { return set.wait(1h).kind(); });
  if (next() % 2 == 0) waits.wait_for(2ms);  // then the thread mostly sleeps
  std::vector<std::shared_ptr<GuardCondition>> guards;
  for (int changes = next() % 5; changes > 0; --changes) {
    if (next() % 2 == 0 || guards.empty()) {
      guards.push_back(std::make_shared<GuardCondition>(context));
      set.add_guard_condition(guards.back());
    } else {
      set.remove_guard_condition(guards.back());
      guards.pop_back();
    }
  }
  TimerBase::SharedPtr timer;
  switch (next() % 4) {
    case 0:
      kept->trigger();
      break;
    case 1:
      guards.push_back(std::make_shared<GuardCondition>(context));
      guards.back()->trigger();
      set.add_guard_condition(guards.back());
      break;
    case 2:
      guards.push_back(std::make_shared<GuardCondition>(context));
      set.add_guard_condition(guards.back());
      guards.back()->trigger();
      break;
    default:
      timer = node->create_wall_timer(
          1us, [] {}, group);
      set.add_timer(timer);
  }
  if (waits.wait_for(kPatience) == std::future_status::ready) {
    return waits.get() == WaitResultKind::Ready ? nullptr : "a wait set has nothing, or ended";
  }
  context->shutdown("");
  return "a wait set slept on when something was ready";
}

const char* switch_a_clock(const Context::SharedPtr& context, const NextByte& next) {
  const auto core = std::make_shared<takt::SimulatedClock>(takt::Clock::steady(), next() % 2 == 0);
  Clock clock(core);
  std::vector<std::future<bool>> sleepers;
  for (int sleeps = next() % 3; sleeps > 0; --sleeps) {
    sleepers.push_back(std::async(std::launch::async, [&] {
      return clock.sleep_for(Duration(std::chrono::hours(1)), context);
    }));
  }
  for (int sets = next() % 4; sets > 0; --sets) core->set(takt::TimePoint(1s * (next() % 100)));
  // Switches repeatedly: a sleep that begins after a switch has the new source from the start.
  const auto end = std::chrono::steady_clock::now() + kPatience;
  for (const auto& sleeper : sleepers) {
    while (sleeper.wait_for(1ms) != std::future_status::ready) {
      core->simulate(!core->simulates());
      if (std::chrono::steady_clock::now() > end) {
        context->shutdown("");
        return "a sleep went on when its clock got another source";
      }
    }
  }
  return nullptr;
}

const char* make_timers(const Context::SharedPtr& context, const NextByte& next) {
  struct Listener final : takt::NodeListener {
    void entity_added(takt::Node&, const std::shared_ptr<takt::Entity>& entity) override {
      const auto* timer = dynamic_cast<const takt::Timer*>(entity.get());
      is_running = timer != nullptr && !timer->is_canceled();
    }
    void group_added(takt::Node&, const std::shared_ptr<takt::CallbackGroup>&) override {}
    void parameters_changed(takt::Node&) override {}
    bool is_running = false;
  } listener;
  const auto node = make_node(context);
  executors::SingleThreadedExecutor executor(of(context));
  executor.add_node(node);
  const auto core = node->get_node_base_interface()->takt_node();
  core->add_listener(listener);
  const bool autostart = next() % 2 == 0, is_reset = next() % 2 == 0;
  int calls = 0;
  const auto timer = node->create_wall_timer(
      1ns,
      [&](TimerBase& self) {
        ++calls;
        self.cancel();
      },
      nullptr, autostart);
  core->remove_listener(listener);
  if (!autostart && listener.is_running) return "an executor got a timer before it was cancelled";
  if (is_reset) timer->reset();
  executor.spin_some();
  const bool runs = autostart || is_reset;
  return calls == (runs ? 1 : 0) ? nullptr : "a timer ran that was not started, or did not run";
}

const char* remove_parameter_callbacks(const Context::SharedPtr& context, const NextByte& next) {
  const auto node = make_node(context);
  node->declare_parameter("value", 0);
  using Handle = node_interfaces::PostSetParametersCallbackHandle;
  std::vector<std::shared_ptr<Handle>> handles(next() % 5);
  std::vector<bool> is_removed(handles.size());
  const char* broken = nullptr;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const std::size_t other = next() % 8;
    const bool drops = next() % 2 == 0;
    handles[i] = node->add_post_set_parameters_callback([&, i, other, drops](const auto&) {
      if (is_removed[i]) broken = "a callback of parameters was called after its removal";
      if (other >= handles.size() || is_removed[other]) return;
      is_removed[other] = true;
      if (drops) {
        handles[other].reset();
      } else {
        node->remove_post_set_parameters_callback(handles[other].get());
      }
    });
  }
  node->set_parameter(Parameter("value", 1));
  node->set_parameter(Parameter("value", 2));
  return broken;
}

}  // namespace rclcpp
