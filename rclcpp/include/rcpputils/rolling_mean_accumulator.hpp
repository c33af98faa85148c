// The mean of the last values, as controllers of wheels use it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace rcpputils {

/// Thread safety: none. It allocates in its constructor only.
template <class T>
class RollingMeanAccumulator {
 public:
  /// `window`: of how many values, 1 or more.
  explicit RollingMeanAccumulator(size_t window) : values_(window) {}

  void accumulate(T value) {
    sum_ += value - values_[next_];
    values_[next_] = value;
    next_ = (next_ + 1) % values_.size();
    if (count_ < values_.size()) ++count_;
  }

  /// Defined once there is a value.
  T getRollingMean() const { return sum_ / static_cast<T>(count_); }

 private:
  std::vector<T> values_;
  size_t next_ = 0, count_ = 0;
  T sum_{};
};

}  // namespace rcpputils
