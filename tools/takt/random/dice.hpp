// Numbers that are drawn from a seed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_
#define TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <random>
#include <utility>
#include <vector>

namespace takt::tools {

/// Draws numbers: the same ones from the same seed, on every machine. The distributions of the
/// standard library differ from one to another.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}

  /// A number from first to last.
  std::size_t between(std::size_t first, std::size_t last) {
    return first + random_() % (last - first + 1);
  }
  bool has(std::size_t percent) { return between(1, 100) <= percent; }
  double below_one() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }
  template <class List>
  const auto& one_of(const List& list) {
    return list[between(0, std::size(list) - 1)];
  }

  /// A period in milliseconds as in cars: Kramer, Ziegenbein, Hamann, "Real World Automotive
  /// Benchmarks For Free", WATERS 2015. `with_longest`: also 1,000.
  int period_ms(bool with_longest = true) {
    constexpr std::array<std::pair<int, std::size_t>, 9> kShares{
        {{1, 3}, {2, 2}, {5, 2}, {10, 25}, {20, 25}, {50, 3}, {100, 20}, {200, 1}, {1000, 4}}};
    std::size_t drawn = between(1, with_longest ? 85 : 81);
    auto share = kShares.begin();
    for (; drawn > share->second; ++share) drawn -= share->second;
    return share->first;
  }

  /// So many shares of a sum, each set as likely as another: UUniFast (Bini, Buttazzo, "Measuring
  /// the Performance of Schedulability Tests", 2005).
  std::vector<double> shares(std::size_t count, double sum) {
    std::vector<double> result;
    for (std::size_t left = count; left > 1; --left) {
      const double next = sum * std::pow(below_one(), 1.0 / static_cast<double>(left - 1));
      result.push_back(sum - next);
      sum = next;
    }
    result.push_back(sum);
    return result;
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_
