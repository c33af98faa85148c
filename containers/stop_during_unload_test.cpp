// Components that complete slowly, loaded and unloaded, in a container that is stopped meanwhile:
// programs of fixed seeds. What the threads do to each other is up to the machine, so this is for
// crashes, sanitizers, and what is completed twice or never.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/container.hpp"
#include "takt/testing/time_bound.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr unsigned kUnloadPrograms = 10;
#else
constexpr unsigned kUnloadPrograms = 25;
#endif

/// What has become of each component, by its name.
class Fates {
 public:
  void made(const std::string& name) {
    change(name, [](Fate& fate) { ++fate.made; });
  }
  void completed(const std::string& name) {
    change(name, [](Fate& fate) { ++fate.completed; });
  }
  void gone(const std::string& name) {
    change(name, [](Fate& fate) { ++fate.gone; });
  }
  void expect_one_of_each() {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, fate] : fates_) {
      EXPECT_EQ(fate.made, 1) << name;
      EXPECT_EQ(fate.completed, 1) << name;
      EXPECT_EQ(fate.gone, 1) << name;
    }
  }

 private:
  struct Fate {
    int made = 0, completed = 0, gone = 0;
  };
  template <class Change>
  void change(const std::string& name, Change&& apply) {
    const std::lock_guard lock(mutex_);
    apply(fates_[name]);
  }
  std::mutex mutex_;
  std::map<std::string, Fate> fates_;
};
Fates* fates = nullptr;

/// Its name's number says for how many milliseconds it completes, and runs its callback.
class SlowToEnd : public Node, public Completing {
 public:
  explicit SlowToEnd(const NodeOptions& options)
      : Node("slow", options), slowness_(std::stoi(name().substr(1)) % 8) {
    timer_ = create_timer("timer", 5ms, [this] { std::this_thread::sleep_for(slowness_); });
    fates->made(name());
  }
  ~SlowToEnd() override { fates->gone(name()); }
  std::string complete() override {
    std::this_thread::sleep_for(slowness_);
    fates->completed(name());
    return "";
  }

 private:
  const std::chrono::milliseconds slowness_;
  std::shared_ptr<Timer> timer_;
};
ComponentDescription slow(unsigned number) {
  ComponentDescription component;
  component.type = "takt::test::SlowToEnd";
  component.name = "n" + std::to_string(number);
  return component;
}

/// Loads and unloads, on a thread of its own, as requests do.
void load_and_unload(Container& container, std::mt19937& random, unsigned& made) {
  for (unsigned left = 3 + static_cast<unsigned>(random() % 6); left > 0; --left) {
    try {
      const auto there = container.components();
      if (there.empty() || random() % 3 == 0) {
        container.load(slow(++made * 8 + static_cast<unsigned>(random() % 8)));
      } else {
        container.unload(there[random() % there.size()].id, 1ms * (random() % 4));
      }
    } catch (const Error&) {  // still runs a callback, or leaves already
    }
  }
}

// stop() read the list of components without its lock, as "all threads have ended"; but the thread
// of an unload whose time was up still completed its component, and took it off the list.
TEST(StopDuringUnload, CompletesEachComponentOnce) {
  const char* const asked = std::getenv("TAKT_UNLOADS");
  const unsigned programs =
      asked != nullptr ? static_cast<unsigned>(std::atoi(asked)) : kUnloadPrograms;
  for (unsigned seed = 0; seed < programs && !testing::Test::HasFailure(); ++seed) {
    const std::string name = fmt::format("StopDuringUnload with seed {}", seed);
    SCOPED_TRACE(name);
    const TimeBound bound(60s, name);
    Fates of_this;
    fates = &of_this;
    std::mt19937 random(seed);
    unsigned made = 0;
    SystemDescription system;
    system.name = "stops";
    for (int i = 0; i < 3; ++i) {
      system.components.push_back(slow(++made * 8 + static_cast<unsigned>(random() % 8)));
    }
    {
      Container container(system);
      container.start();
      container.release();
      std::thread requests([&] { load_and_unload(container, random, made); });
      requests.join();
      container.hold();
      container.stop();
    }
    of_this.expect_one_of_each();
  }
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::SlowToEnd, "completes slowly")
