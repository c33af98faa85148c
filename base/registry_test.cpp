// Tests of things chosen by name.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/registry.hpp"

#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using testing::ElementsAre;
using testing::ThrowsMessage;

struct Shape {
  explicit Shape(int corner_count) : corners(corner_count) {}
  int corners;
};
struct ShapeTraits {
  bool is_round = false;
};
using Shapes = Registry<Shape, ShapeTraits, int>;

Shapes::Factory plus(int more) {
  return [more](int corners) { return std::make_unique<Shape>(corners + more); };
}

TEST(Registry, MakesWhatWasAddedUnderTheNameWithTheArguments) {
  Shapes shapes("shape");
  shapes.add("same", {"as it is", plus(0)});
  shapes.add("more", {"with one more", plus(1)});
  EXPECT_EQ(shapes.make("same", 3)->corners, 3);
  EXPECT_EQ(shapes.make("more", 3)->corners, 4);
}

TEST(Registry, HandsOverArgumentsThatCanOnlyBeMoved) {
  Registry<Shape, NoTraits, std::unique_ptr<int>> shapes("shape");
  shapes.add("moved", {"", [](std::unique_ptr<int> n) { return std::make_unique<Shape>(*n); }});
  EXPECT_EQ(shapes.make("moved", std::make_unique<int>(5))->corners, 5);
}

TEST(Registry, ListsNamesInOrderAndDescribesThem) {
  Shapes shapes("shape");
  EXPECT_TRUE(shapes.names().empty());
  shapes.add("more", {"with one more", plus(1)});
  shapes.add("less", {"with one less", plus(-1)});
  EXPECT_THAT(shapes.names(), ElementsAre("less", "more"));
  EXPECT_EQ(shapes.description("more"), "with one more");
}

TEST(Registry, SaysWhatSomethingIsLikeWithoutMakingIt) {
  Shapes shapes("shape");
  const auto never = [](int) -> std::unique_ptr<Shape> { throw Error("made"); };
  shapes.add("circle", {"", never, {.is_round = true}});
  shapes.add("square", {"", never});
  EXPECT_TRUE(shapes.traits("circle").is_round);
  EXPECT_FALSE(shapes.traits("square").is_round);
  EXPECT_THROW(shapes.traits("cube"), Error);
}

TEST(Registry, RefusesANameThatIsTaken) {
  Shapes shapes("shape");
  shapes.add("more", {"the first", plus(1)});
  EXPECT_THAT(
      [&] {
        shapes.add("more", {"the second", plus(2)});
      },
      ThrowsMessage<Error>("shape 'more' is registered twice"));
  EXPECT_EQ(shapes.description("more"), "the first");
  EXPECT_EQ(shapes.make("more", 0)->corners, 1);
}

TEST(Registry, AnswersAnUnknownNameWithTheValidOnes) {
  Shapes shapes("shape");
  shapes.add("more", {"", plus(1)});
  shapes.add("less", {"", plus(-1)});
  const auto expected =
      ThrowsMessage<Error>("no shape is called 'mroe'; did you mean 'more'? valid: less, more");
  EXPECT_THAT([&] { shapes.make("mroe", 1); }, expected);
  EXPECT_THAT([&] { shapes.check("mroe"); }, expected);
  EXPECT_THAT([&] { shapes.description("mroe"); }, expected);
  EXPECT_NO_THROW(shapes.check("more"));
}

TEST(Registry, CanBeFilledAndUsedByManyThreads) {
  constexpr int kThreads = 4;
  constexpr int kNames = 50;
  Shapes shapes("shape");
  std::latch start(kThreads);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      start.arrive_and_wait();
      for (int i = 0; i < kNames; ++i) {
        const std::string name = std::to_string(thread) + "_" + std::to_string(i);
        shapes.add(name, {"", plus(i)});
        EXPECT_EQ(shapes.make(name, 1)->corners, i + 1);
        EXPECT_FALSE(shapes.names().empty());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(shapes.names().size(), std::size_t{kThreads * kNames});
}

}  // namespace
}  // namespace takt
