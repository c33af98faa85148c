// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/programs.hpp"

#include <algorithm>
#include <cstdlib>
#include <random>

#include <fmt/format.h>

namespace takt::sequences {
namespace {

Bytes removed_while_callbacks_publish() {
  Bytes bytes{8, 1, 0, 0, 1, 2, 0, 3, 0, 0};
  for (int i = 0; i < 40; ++i) bytes.insert(bytes.end(), {21, 0, 8, 0, 3});
  return bytes;
}

}  // namespace

const std::vector<Kept>& kept_programs() {
  static const std::vector<Kept> programs{

      Kept{"EndlessSpinUntil", {0, 0, 0, 19, 0, 1}},
      Kept{"EndlessSpinUntilOfIsolated", {0, 2, 0, 0, 19, 0, 15}},
      Kept{"TimeOutForEver", {0, 0, 0, 19, 2}}, Kept{"PeriodForEver", {0, 0, 0, 0, 1, 1, 3}},
      Kept{"TimerAfterHold", {0, 0, 0, 0, 1, 1, 0, 0, 0, 3, 0, 0, 17}},
      Kept{"DroppedAndAddedAgain", {0, 10, 0, 0, 7, 3, 0, 14, 21, 0, 10, 0, 8, 0, 9}},
      Kept{"RemovedWhileCallbacksPublish", removed_while_callbacks_publish()},
      // The result of a wait set owns a guard condition, whose destructor removes another member of
      // the set. The set destroyed it under its lock, and waited for itself.
      Kept{"WaitSetLetsGoWhatRemovesAnother",
           {0, 1,  0, 0, 0,  3, 0,  0, 3,  0, 0,  51, 0, 51, 1, 6,
            0, 54, 3, 1, 53, 0, 10, 0, 63, 1, 54, 1,  1, 6,  0}},
      // A coroutine that continued after the end of its goal kept the place of the next goal, which
      // was accepted, and then aborted.
      Kept{"GoalAfterACoroutineThatGoesOn",
           {0, 1, 0, 0, 1, 27, 4, 0, 2, 0, 0, 28, 0, 0, 0, 0, 29, 0, 1, 20, 29, 0, 1, 20}},
      // A nested spin for the same future timed out: the outer one then slept on.
      Kept{"NestedSpinsForOneFuture",
           {0, 1, 0, 0, 1, 3, 0, 0, 40, 1, 0, 46, 6, 0, 16, 1, 48, 0, 3, 1, 48, 0, 1}},
      // `isolated`: an exception of a callback ended the spin, and the future still had the
      // executor.
      Kept{"PromiseAfterTheExecutorThatWaited",
           {0,  1, 0, 0,  0, 3,  0, 0, 40, 2,  0,  0, 41, 0,  3,
            46, 6, 0, 16, 1, 48, 0, 2, 0,  13, 40, 1, 0,  47, 0}}};
  return programs;
}

namespace {

/// A kept program with a few bytes changed, and random bytes appended.
Bytes mutated_program(std::mt19937& random) {
  Bytes bytes = kept_programs()[random() % kept_programs().size()].bytes;
  bytes.resize(std::min<std::size_t>(bytes.size(), 40));  // the longest one takes its time
  for (auto left = random() % 4; left > 0; --left) {
    bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
  }
  for (auto left = random() % 50; left > 0; --left) {
    bytes.push_back(static_cast<std::uint8_t>(random()));
  }
  return bytes;
}

/// A program that begins with calls that a few random bytes would seldom make: nodes in and out of
/// executors, a second executor, a promise, calls in callbacks and destructors. Then come random
/// bytes.
Bytes random_program(std::mt19937& random, const std::vector<Bytes>& often) {
  if (random() % 4 == 0) return mutated_program(random);
  const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
  Bytes bytes{byte(), byte(), byte(), byte()};
  const auto perhaps = [&](std::initializer_list<std::uint8_t> call) {
    if (random() % 2 == 0) bytes.insert(bytes.end(), call);
  };
  perhaps({0, 1});                                        // a node in the executor
  perhaps({0, 0});                                        // and one in none
  perhaps({40, byte(), byte(), byte()});                  // the other executor
  perhaps({41, byte(), 3});                               // has a node
  perhaps({3, byte(), byte()});                           // a guard condition
  perhaps({27, byte(), byte(), byte(), byte(), byte()});  // an action server
  perhaps({28, byte(), byte(), byte(), byte()});          // its client
  perhaps({46});                                          // a promise
  perhaps({16, 7});                                       // calls in callbacks
  perhaps({63, 7});                                       // and in destructors
  perhaps({6, byte()});                                   // the guard condition is triggered
  perhaps({48, 0, byte(), byte(), byte()});               // a spin waits for the promise
  const auto append = [&](const Bytes& call) {
    bytes.insert(bytes.end(), call.begin(), call.end());
  };
  for (const Bytes& call : often) {
    if (random() % 2 == 0) append(call);
  }
  for (std::size_t left = random() % 200; left > 0; --left) {
    if (!often.empty() && random() % 2 == 0) {
      append(often[random() % often.size()]);
    } else {
      bytes.push_back(byte());
    }
  }
  return bytes;
}

}  // namespace

std::string run_random(int programs, const std::vector<Bytes>& often,
                       const std::function<std::unique_ptr<Api>()>& make_api) {
  const char* const asked = std::getenv("TAKT_SEQUENCES");
  if (asked != nullptr) programs = std::atoi(asked);
  std::mt19937 random(15);
  for (int program = 0; program < programs; ++program) {
    const Bytes bytes = random_program(random, often);
    const std::string broken = run(bytes, *make_api());
    if (broken.empty()) continue;
    return fmt::format("program {}, {{{}}}: {}", program, fmt::join(bytes, ", "), broken);
  }
  return {};
}

}  // namespace takt::sequences
