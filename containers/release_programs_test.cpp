// Programs of bytes that load, unload and release components: a container begins the phase of
// timers, and touches none that somebody has cancelled, or given a time.
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/container.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kPeriod = 1h;
constexpr int kPrograms = 300;
constexpr std::size_t kMostComponents = 4;

/// A timer, and what it has to be.
struct ModelledTimer {
  std::shared_ptr<Timer> timer;
  bool is_cancelled = false, is_given = false;
  TimePoint next{};

  void plain(TimePoint now) { is_cancelled = false, is_given = false, next = now + kPeriod; }
  void change(unsigned how, TimePoint now) {
    switch (how % 4) {
      case 0:
        timer->cancel();
        is_cancelled = true;
        return;
      case 1:
        timer->reset();
        return plain(now);
      case 2:
        timer->reset();
        timer->release_at(now + 10min);
        plain(now);
        is_given = true;
        next = now + 10min;
        return;
      default:  // as it is
        return;
    }
  }
  void begin_phase(TimePoint now) {
    if (!is_cancelled && !is_given) next = now + kPeriod;
  }
  bool holds() const {
    return timer->is_canceled() == is_cancelled && (is_cancelled || timer->next_release() == next);
  }
};
using ModelledTimers = std::vector<ModelledTimer>;

/// The bytes that decide, and what the constructor that they lead to has made.
class Program {
 public:
  explicit Program(unsigned seed) : random_(seed) {
    SystemDescription system;
    system.file = "test.yaml";
    system.executors.push_back({.name = "default"});
    container_.emplace(system, ContainerOverrides{.clock = &clock_});
    current = this;
  }
  /// The first call after which a timer is not as it has to be.
  std::string run() {
    for (int call = 0; call < 30; ++call) {
      const char* const what = act(pick(6));
      for (const auto& [id, timers] : loaded_) {
        for (const ModelledTimer& timer : timers) {
          if (!timer.holds()) return std::string(what) + ", call " + std::to_string(call);
        }
      }
    }
    return "";
  }
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }
  TimePoint now() const { return clock_.now(); }

  static inline Program* current = nullptr;
  ModelledTimers made;

 private:
  auto any() { return std::next(loaded_.begin(), pick(static_cast<unsigned>(loaded_.size()))); }
  const char* act(unsigned what) {
    switch (what) {
      case 0:
        load();
        return "load";
      case 1:
        if (!loaded_.empty()) {
          const auto component = any();
          container_->unload(component->first);
          loaded_.erase(component);
        }
        return "unload";
      case 2:
        container_->release();
        for (auto& [id, timers] : loaded_) begin_phases(timers);
        return "release";
      case 3:
        if (!loaded_.empty()) {
          ModelledTimers& timers = any()->second;
          if (!timers.empty()) {
            timers[pick(static_cast<unsigned>(timers.size()))].change(pick(3), now());
          }
        }
        return "change";
      default:
        clock_.advance(Nanoseconds(pick(1000) * 1'000'000));
        return "advance";
    }
  }
  void load() {
    if (loaded_.size() == kMostComponents) return;
    made.clear();
    const LoadedComponent component =
        container_->load({.type = "test::Made", .name = "made_" + std::to_string(++named_)});
    begin_phases(made);
    loaded_.emplace(component.id, std::move(made));
  }
  void begin_phases(ModelledTimers& timers) {
    for (ModelledTimer& timer : timers) timer.begin_phase(now());
  }

  std::mt19937 random_;
  ManualClock clock_;
  std::optional<Container> container_;
  std::map<std::uint64_t, ModelledTimers> loaded_;
  int named_ = 0;
};

class Made : public Node {
 public:
  explicit Made(const NodeOptions& options) : Node("made", options) {
    Program& program = *Program::current;
    for (unsigned i = program.pick(4); i > 0; --i) {
      ModelledTimer made{create_timer("timer_" + std::to_string(i), kPeriod, [] {})};
      made.plain(program.now());
      for (int change = 0; change < 2; ++change) made.change(program.pick(4), program.now());
      program.made.push_back(std::move(made));
    }
  }
};

TEST(Release, OfAnyProgramBeginsPhasesAndTouchesNothingElse) {
  components().add("test::Made", {"for tests", [](const NodeOptions& options) {
                                    return std::make_unique<Component>(
                                        Component{std::make_shared<Made>(options)});
                                  }});
  for (int seed = 0; seed < kPrograms; ++seed) {
    ASSERT_EQ(Program(static_cast<unsigned>(seed)).run(), "") << "program " << seed;
  }
}

}  // namespace
}  // namespace takt::test
