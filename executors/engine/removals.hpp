// Which groups and nodes are being removed from an executor, and by how many threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_REMOVALS_HPP_
#define TAKT_EXECUTORS_ENGINE_REMOVALS_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>

namespace takt::detail {

/// Several threads may remove a group or node at the same time. That is one removal, with a number:
/// the first thread that finishes ends it for all.
/// Thread safety: begin, end and contains with the callbacks' mutex held; the rest from any thread.
/// Real-time: no.
class Removals {
 public:
  /// The number of the removal in progress, or a new one.
  std::uint64_t begin(const void* what) {
    const auto [removal, is_new] = numbers_.try_emplace(what, last_ + 1);
    if (is_new) ++last_;
    return removal->second;
  }
  /// False if another thread has ended this removal: what the executor has now was added later.
  bool end(const void* what, std::uint64_t removal) noexcept {
    const auto known = numbers_.find(what);
    if (known == numbers_.end() || known->second != removal) return false;
    numbers_.erase(known);
    return true;
  }
  bool contains(const void* what) const noexcept { return numbers_.contains(what); }

  /// A thread will remove a callback, or wait until another one has.
  void expect() noexcept { expected_.fetch_add(1); }
  void are_over(std::size_t count) noexcept {
    if (expected_.fetch_sub(count) == count) expected_.notify_all();
  }
  bool are_expected() const noexcept { return expected_.load() != 0; }
  void wait() const noexcept {
    for (std::size_t left; (left = expected_.load()) != 0;) expected_.wait(left);
  }

 private:
  std::map<const void*, std::uint64_t> numbers_;
  std::uint64_t last_ = 0;
  std::atomic<std::size_t> expected_{0};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_REMOVALS_HPP_
