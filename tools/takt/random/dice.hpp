// Numbers that are drawn from a seed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_
#define TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_

#include <algorithm>
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

  /// The same where none is above 1, of a sum up to `count`: RandFixedSum (Emberson, Stafford,
  /// Davis, "Techniques For The Synthesis Of Multiprocessor Tasksets", WATERS 2010). Sets of shares
  /// are a polytope, which consists of simplices of several kinds: it walks to one, as often as its
  /// volume says, and draws a point of it.
  std::vector<double> shares_up_to_one(std::size_t count, double sum) {
    if (sum <= 1) return shares(count, sum);
    const auto floor = std::min(static_cast<std::size_t>(sum), count - 1);
    // turns[i][j]: how probably the last step to a simplex of i + 2 shares goes up, of j ones.
    std::vector<std::vector<double>> turns;
    std::vector<double> volumes(count + 1, 0);
    volumes[1] = 1;
    for (std::size_t size = 2; size <= count; ++size) {
      std::vector<double> next(count + 1, 0), turn(size, 0);
      for (std::size_t j = 1; j <= size; ++j) {
        const double above = sum + static_cast<double>(j) - 1 - static_cast<double>(floor);
        const double below = static_cast<double>(floor + 1 + size - j) - sum;
        const double up = volumes[j] * above, down = volumes[j - 1] * below;
        next[j] = up + down;
        const double share = next[j] > 0 ? (below > above ? down : up) / next[j] : 0;
        turn[j - 1] = below > above ? share : 1 - share;
      }
      const double largest = *std::max_element(next.begin(), next.end());
      for (double& volume : next) volume /= largest;  // only ratios count
      turns.push_back(std::move(turn));
      volumes = std::move(next);
    }
    return point_of(turns, sum, floor);
  }

 private:
  std::vector<double> point_of(const std::vector<std::vector<double>>& turns, double sum,
                               std::size_t floor) {
    std::vector<double> result;
    double reached = 0, scale = 1;
    for (std::size_t left = turns.size(); left > 0; --left) {
      const bool goes_up = below_one() <= turns[left - 1][floor];
      const double part = std::pow(below_one(), 1.0 / static_cast<double>(left));
      reached += (1 - part) * scale * sum / static_cast<double>(left + 1);
      scale *= part;
      result.push_back(reached + (goes_up ? scale : 0));
      if (!goes_up) continue;
      sum -= 1;
      if (floor > 0) --floor;
    }
    result.push_back(reached + scale * sum);
    for (std::size_t i = result.size(); i > 1; --i) {
      std::swap(result[i - 1], result[between(0, i - 1)]);
    }
    return result;
  }

  std::mt19937_64 random_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RANDOM_DICE_HPP_
