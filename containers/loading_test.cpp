// Components that come and go while their container runs.
// SPDX-License-Identifier: Apache-2.0
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/library.hpp"
#include "takt/containers/container.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_state.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/testing/memory_in_use.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// What the components below report to the tests.
struct Board {
  std::mutex mutex;
  std::condition_variable changed;
  int alive = 0, ticks = 0;
  bool is_blocked = false, is_in_callback = false;

  template <class Change>
  void change(Change&& change_it) {
    {
      const std::lock_guard lock(mutex);
      change_it(*this);
    }
    changed.notify_all();
  }
  template <class Condition>
  bool wait(Condition&& condition) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, 10s, [&] { return condition(*this); });
  }
};
Board board;

/// Ticks each millisecond; `fails` ticks end by an exception.
class Guest : public Node {
 public:
  explicit Guest(const NodeOptions& options) : Node("guest", options) {
    board.change([](Board& b) { ++b.alive; });
    if (declare_parameter("throws", false)) {
      board.change([](Board& b) { --b.alive; });
      throw std::runtime_error("as you wish");
    }
    const bool fails = declare_parameter("fails", false);
    const auto group = create_callback_group("loop", CallbackGroupType::MutuallyExclusive);
    timer_ = create_timer(
        "tick", 1ms,
        [fails] {
          board.change([](Board& b) { ++b.ticks, b.is_in_callback = true; });
          board.wait([](const Board& b) { return !b.is_blocked; });
          board.change([](Board& b) { b.is_in_callback = false; });
          if (fails) throw std::runtime_error("boom");
        },
        group);
  }
  ~Guest() override {
    timer_.reset();
    if (timer_ == nullptr) board.change([](Board& b) { --b.alive; });
  }

 private:
  std::shared_ptr<Timer> timer_;
};

/// Ticks in both of its groups in turn, whatever its state: a tick of one lets the other tick.
class ManagedGuest : public LifecycleNode {
 public:
  explicit ManagedGuest(const NodeOptions& options) : LifecycleNode("managed", options) {
    const auto group = create_callback_group("loop", CallbackGroupType::MutuallyExclusive);
    rest_ = Node::create_timer("rest_tick", 1ms, [this] { turn(false); });
    loop_ = Node::create_timer(
        "loop_tick", 1ms, [this] { turn(true); }, group);
  }

 private:
  void turn(bool is_loop) {
    if (is_loops_turn_.load() != is_loop) return;
    board.change([](Board& b) { ++b.ticks; });
    is_loops_turn_.store(!is_loop);
  }
  std::atomic<bool> is_loops_turn_{false};
  std::shared_ptr<Timer> rest_, loop_;
};

class Loading : public testing::Test {
 protected:
  Loading() {
    board.change([](Board& b) { b.ticks = 0, b.is_blocked = false; });
  }
  ~Loading() override {
    if (container_ == nullptr) return;
    container_->hold();
    container_->stop();
    container_.reset();
    EXPECT_EQ(board.alive, 0);
  }

  void start(const std::string& type, std::vector<ExecutorDescription> more = {}) {
    SystemDescription system;
    system.file = "test.yaml";
    system.executors = {{.name = "default", .type = type}};
    for (auto& executor : more) system.executors.push_back(executor);
    system.threads.push_back({.attributes = {.name = "container"}});
    container_ = std::make_unique<Container>(system);
    container_->start();
    container_->release();
  }
  static bool ticks_on() {
    int before = 0;
    board.change([&](const Board& b) { before = b.ticks; });
    return board.wait([=](const Board& b) { return b.ticks >= before + 3; });
  }
  template <class Function>
  static std::string error_of(Function&& function) {
    try {
      function();
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  }

  const ComponentDescription guest_{.type = "takt::test::Guest"};
  std::unique_ptr<Container> container_;
};

TEST_F(Loading, BringsComponentsUnderEveryExecutorThatTakesThem) {
  for (const std::string& type : executors().names()) {
    if (executors().traits(type).frozen || type.starts_with("never_made")) continue;  // of a test
    start(type);
    const LoadedComponent loaded = container_->load(guest_);
    EXPECT_EQ(loaded.name, "/guest");
    EXPECT_TRUE(ticks_on()) << type;
    ASSERT_EQ(container_->components().size(), 1u);
    EXPECT_EQ(container_->components()[0].id, loaded.id);
    container_->unload(loaded.id);
    EXPECT_EQ(board.alive, 0) << type;
    EXPECT_THAT(container_->components(), IsEmpty());
    container_->hold();
    container_->stop();
    container_.reset();
  }
}

TEST_F(Loading, ThatFailsSaysWhyAndLeavesNothingBehind) {
  start("events");
  ComponentDescription throws = guest_;
  throws.parameters["throws"] = true;
  EXPECT_THAT(error_of([&] { container_->load(throws); }),
              HasSubstr("component 'takt::test::Guest' could not be made: as you wish"));
  ComponentDescription unknown{.type = "takt::test::Gast"};
  EXPECT_THAT(error_of([&] { container_->load(unknown); }),
              StartsWith("no component is called 'takt::test::Gast'; did you mean "
                         "'takt::test::Guest'?"));
  ComponentDescription wrong = guest_;
  wrong.callback_groups["lop"] = {};
  EXPECT_THAT(error_of([&] { container_->load(wrong); }),
              HasSubstr("has no callback group 'lop'; did you mean 'loop'?"));
  EXPECT_THAT(container_->components(), IsEmpty());
  EXPECT_EQ(board.alive, 0);
  container_->load(guest_);
  EXPECT_THAT(error_of([&] { container_->load(guest_); }),
              HasSubstr("is called '/guest' already; give each its own name"));
  EXPECT_EQ(board.alive, 1);
  EXPECT_THAT(error_of([&] { container_->unload(77); }),
              StartsWith("there is no component 77; loaded: "));
  EXPECT_TRUE(ticks_on());
}

TEST_F(Loading, OfWhatNoReaderHasCheckedIsCheckedHere) {
  start("events");
  const auto loading = [&](ComponentDescription guest) {
    return error_of([&] { container_->load(std::move(guest)); });
  };
  ComponentDescription guest = guest_;
  guest.executor = "fast";
  EXPECT_EQ(loading(guest), "no executor is called 'fast'; valid: default");
  guest = guest_;
  guest.callback_groups["loop"].executor = "fast";
  EXPECT_EQ(loading(guest), "no executor is called 'fast'; valid: default");
  guest = guest_;
  guest.parameters["thorws"] = true;
  EXPECT_THAT(loading(guest),
              StartsWith("component 'takt::test::Guest' has no parameter 'thorws'"));
  guest = guest_;
  guest.remap["in"] = "out";
  EXPECT_THAT(loading(guest),
              StartsWith("component 'takt::test::Guest' has no topic to remap 'in'"));
  EXPECT_EQ(board.alive, 0);
}

TEST_F(Loading, NeedsAnExecutorAndForRemovalAThread) {
  container_ = std::make_unique<Container>(SystemDescription{});
  container_->start();
  container_->release();
  EXPECT_EQ(error_of([&] { container_->load(guest_); }),
            "no executor is called 'default'; describe one under 'executors'");
  container_->stop();
  container_ = std::make_unique<Container>(SystemDescription{.executors = {{.name = "default"}}});
  container_->start();
  container_->release();
  ComponentDescription guest = guest_;
  guest.on_exception = OnException::remove_node;
  EXPECT_EQ(error_of([&] { container_->load(guest); }),
            "'on_exception: remove_node' needs a thread that removes the node; add a thread called "
            "'container'");
  EXPECT_EQ(board.alive, 0);
}

TEST_F(Loading, IsRefusedByAStaticExecutorThatSpins) {
  start("static_single_threaded");
  container_->load(guest_);  // from here on
  ComponentDescription other = guest_;
  other.name = "other";
  EXPECT_THAT(error_of([&] { container_->load(other); }),
              HasSubstr("is static: nothing can be added after its first spin"));
  EXPECT_EQ(board.alive, 1);
}

TEST_F(Loading, AComponentThatCannotBeUnloadedKeepsItsServicesAndItsExecutors) {
  for (const bool is_static : {true, false}) {
    SystemDescription system;
    system.file = "test.yaml";
    system.executors = {{.name = "events", .type = "events"},
                        {.name = "static", .type = "static_single_threaded"}};
    ComponentDescription guest{.type = "takt::test::ManagedGuest", .name = "managed"};
    guest.executor = is_static ? "static" : "events";
    guest.callback_groups["loop"] = {.executor = is_static ? "events" : "static"};
    system.components = {guest};
    system.threads.push_back({.attributes = {.name = "container"}});
    container_ = std::make_unique<Container>(system);
    container_->start();
    container_->release();
    const auto client =
        std::make_shared<Node>("asking")->create_client<lifecycle_msgs::srv::GetState>(
            "/managed/get_state");
    EXPECT_TRUE(client->service_is_ready());
    for (int i = 0; i < 2; ++i) {
      EXPECT_THAT(error_of([&] { container_->unload(container_->components()[0].id); }),
                  HasSubstr("is static: nothing can be removed after its first spin"));
      ASSERT_EQ(container_->components().size(), 1u);
      EXPECT_TRUE(client->service_is_ready());
      EXPECT_TRUE(ticks_on());
    }
    container_->hold();
    container_->stop();
    container_.reset();
  }
}

TEST_F(Loading, IsRefusedWhenTheExecutorCannotServeIt) {
  start("events");
  ComponentDescription heavy = guest_;
  heavy.callback_groups["loop"] = {.parameters = {.budget = 600us}};
  container_->load(heavy);
  heavy.name = "second";
  EXPECT_THAT(error_of([&] { container_->load(heavy); }),
              HasSubstr("the budgets of the callbacks of executor 'default' are 120 % of its 1 "
                        "thread; give some of them to another executor"));
  ASSERT_EQ(container_->components().size(), 1u);
  container_->unload(container_->components()[0].id);
  container_->load(heavy);
}

TEST_F(Loading, IsRefusedWhenAChainCouldMissItsDeadline) {
  SystemDescription system;
  system.file = "test.yaml";
  system.executors = {{.name = "default", .type = "chain_aware"}};
  system.machine.is_exclusive = true;  // otherwise nothing is guaranteed that could be lost
  ComponentDescription urgent = guest_;
  urgent.name = "urgent";
  urgent.executor = "default";
  urgent.callback_groups["loop"] = {.parameters = {.priority = 10, .budget = 300us}};
  system.components = {urgent};
  ChainDescription& chain = system.chains.emplace_back();
  chain.options.name = "tick";
  chain.options.priority = 1;
  chain.options.deadline = 500us;
  chain.path = {{"/urgent", "tick"}};
  system.threads.push_back({.attributes = {.name = "container"}});
  container_ = std::make_unique<Container>(system);
  container_->start();
  container_->release();
  ComponentDescription other = guest_;
  other.callback_groups["loop"] = {.parameters = {.priority = 5, .budget = 250us}};
  EXPECT_THAT(
      error_of([&] { container_->load(other); }),
      HasSubstr(
          "with '/guest', chain 'tick' could take 549.999us, and its deadline is "
          "500us; without, the chain takes 300us at most; give the component another executor"));
  other.callback_groups["loop"].parameters.budget = 100us;
  EXPECT_NO_THROW(container_->load(other));
}

TEST_F(Loading, GivesGroupsToTheExecutorsThatTheyName) {
  start("events", {{.name = "apart", .type = "isolated"}});
  ComponentDescription split = guest_;
  split.callback_groups["loop"] = {.executor = "apart"};
  const std::uint64_t id = container_->load(split).id;
  EXPECT_TRUE(ticks_on());
  container_->unload(id);
  EXPECT_EQ(board.alive, 0);
}

TEST_F(Loading, UnloadWaitsForARunningCallbackButNotForEver) {
  start("events");
  const std::uint64_t id = container_->load(guest_).id;
  board.change([](Board& b) { b.is_blocked = true; });
  ASSERT_TRUE(board.wait([](const Board& b) { return b.is_in_callback; }));
  EXPECT_THAT(
      error_of([&] { container_->unload(id, 20ms); }),
      HasSubstr("still runs a callback after 20ms; it is destroyed when the callback returns"));
  EXPECT_THAT(container_->components(), IsEmpty());
  EXPECT_THAT(error_of([&] { container_->unload(id); }), HasSubstr("is being unloaded already"));
  board.change([](Board& b) { b.is_blocked = false; });
  EXPECT_TRUE(board.wait([](const Board& b) { return b.alive == 0; }));
}

std::size_t entries_of(const char* folder) {
  const std::filesystem::directory_iterator entries(folder);
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

// Each time under a new name. Without DDS: Cyclone itself keeps a quarter of a kilobyte of each
// endpoint that ever was (see load_soak_test.cpp). A leak makes each stretch of the cycles dearer.
// What malloc keeps for the next use of a thread counts as in use: on a loaded machine, where
// threads free in another order, that was once more than 64 kB in all.
TEST_F(Loading, AThousandTimesLeaksNeitherMemoryNorThreadsNorDescriptors) {
  constexpr std::int64_t kStretches = 5, kCycles = 200;
  for (const char* type : {"events", "isolated", "multi_threaded"}) {
    start(type);
    int loaded = 0;
    const auto cycle = [&] {
      ComponentDescription guest = guest_;
      guest.name = fmt::format("guest_{:06}", ++loaded);
      container_->unload(container_->load(guest).id);
      // `isolated` still held one of 300 for a moment, and destroyed it on its own thread.
      ASSERT_EQ(board.alive, 0);
    };
    for (int i = 0; i < 10; ++i) cycle();
    const std::size_t threads = entries_of("/proc/self/task");
    const std::size_t descriptors = entries_of("/proc/self/fd");
    const std::int64_t before = memory_in_use();
    std::int64_t memory = before, least = INT64_MAX;
    for (int stretch = 0; stretch < kStretches; ++stretch) {
      for (int i = 0; i < kCycles; ++i) cycle();
      const std::int64_t after = memory_in_use();
      least = std::min(least, after - std::exchange(memory, after));
    }
    // A thread that was joined stands there for some µs more, before too.
    const TimePoint late = Clock::steady().now() + 5s;
    while (entries_of("/proc/self/task") > threads && Clock::steady().now() < late) {
      std::this_thread::yield();
    }
    EXPECT_LE(entries_of("/proc/self/task"), threads) << type;
    EXPECT_EQ(entries_of("/proc/self/fd"), descriptors) << type;
    if (kKnowsMemoryInUse) {
      EXPECT_LT(least, kCycles * 31) << type;         // the smallest block is of 32 bytes
      EXPECT_LT(memory, before + 1'000'000) << type;  // the statistics of the last hundred, at most
    }
    EXPECT_EQ(board.alive, 0);
    container_->hold();
    container_->stop();
    container_.reset();
  }
}

// ---- Exceptions ----

TEST_F(Loading, AnExceptionEndsNothingWhereItIsIgnored) {
  start("multi_threaded");
  ComponentDescription fails = guest_;
  fails.parameters["fails"] = true;
  fails.on_exception = OnException::ignore;
  container_->load(fails);
  EXPECT_TRUE(ticks_on());
}

TEST_F(Loading, AnExceptionTakesTheNodeFromItsExecutorsAndTheOthersGoOn) {
  for (const char* type : {"events", "isolated", "multi_threaded"}) {
    start(type);
    ComponentDescription fails = guest_;
    fails.parameters["fails"] = true;
    fails.on_exception = OnException::remove_node;
    const std::uint64_t id = container_->load(fails).id;
    ASSERT_TRUE(board.wait([](const Board& b) { return b.ticks > 0; }));
    // It ticks no more when it can be loaded again: unloading is complete.
    container_->unload(id);
    board.change([](Board& b) { b.ticks = 0; });
    container_->load(guest_);
    EXPECT_TRUE(ticks_on()) << type;
    container_->hold();
    container_->stop();
    container_.reset();
  }
}

// ---- Libraries ----

TEST(ComponentLibrary, BringsItsComponents) {
  EXPECT_NO_THROW(find_component("guests::Good", TAKT_TEST_COMPONENTS));
  EXPECT_NO_THROW(find_component("guests::Good", TAKT_TEST_COMPONENTS));
  EXPECT_NE(components().make("guests::Good", NodeOptions{}), nullptr);
  try {
    find_component("guests::God", TAKT_TEST_COMPONENTS);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("registers no component 'guests::God'; did you mean "
                                        "'guests::Good'?"));
  }
}

TEST(ComponentLibrary, ThatIsBrokenIsRefusedWithTheReason) {
  const auto error_of = [](const std::string& library) -> std::string {
    try {
      find_component("guests::Good", library);
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(error_of("libm.so.6"),
              StartsWith("library 'libm.so.6' registers no component; add "
                         "TAKT_REGISTER_COMPONENT(guests::Good) to its code"));
  EXPECT_THAT(error_of(TAKT_OLD_COMPONENTS),
              HasSubstr("was built against Takt 0.0.1, and this is"));
  EXPECT_THAT(error_of(TAKT_UNDEFINED_COMPONENTS), HasSubstr("undefined symbol"));
  EXPECT_EQ(error_of(TAKT_TEST_COMPONENTS), "no error");
  EXPECT_THAT(error_of(TAKT_SECOND_COMPONENTS),
              HasSubstr("registers component 'guests::Good', and there is one already"));
  EXPECT_THAT(error_of("./no.so"), HasSubstr("cannot be loaded: ./no.so: cannot open"));
}

TEST(ComponentLibrary, BringsItsMessageTypes) {
  EXPECT_EQ(message_types().find("weather/msg/Wind"), nullptr);
  find_component("weather::Roof", TAKT_WEATHER);
  EXPECT_NE(message_types().find("weather/msg/Wind"), nullptr);
  EXPECT_NE(message_types().find("weather/srv/Calibrate_Request"), nullptr);
}

TEST(ComponentLibrary, WithAnotherLayoutOfATypeIsRefused) {
  load_message_types(TAKT_WEATHER);
  try {
    find_component("weather::OtherRoof", TAKT_OTHER_WEATHER);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("register the message type weather/msg/Wind with "
                                        "different layouts"));
  }
}

TEST(ComponentIndex, IsReadFromThePrefixesOfTheEnvironment) {
  namespace fs = std::filesystem;
  std::string prefix = testing::TempDir() + "takt_XXXXXX";
  ASSERT_NE(mkdtemp(prefix.data()), nullptr);
  fs::create_directories(fs::path(prefix) / "share/takt/components");
  const auto write = [&](const std::string& text) {
    std::ofstream(fs::path(prefix) / "share/takt/components/mine") << text;
  };
  setenv("TAKT_COMPONENT_PATH", prefix.c_str(), 1);
  write("mine::One;lib/libmine.so\nmine::Two;/opt/libtwo.so\n");
  std::vector<std::string> found;
  for (const auto& [name, library] : component_index()) {
    if (name.starts_with("mine::")) found.push_back(library);
  }
  EXPECT_THAT(found, ElementsAre(prefix + "/lib/libmine.so", "/opt/libtwo.so"));
  write("mine::One\n");
  try {
    component_index();
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(
        error.what(),
        HasSubstr("/share/takt/components/mine:1: 'mine::One' is not an entry of the component "
                  "index; write 'namespace::Class;lib/libname.so'"));
  }
  unsetenv("TAKT_COMPONENT_PATH");
  fs::remove_all(prefix);
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::Guest)
TAKT_REGISTER_COMPONENT(takt::test::ManagedGuest)
