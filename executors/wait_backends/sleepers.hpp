// Which of the threads that sleep in a wait back end have been woken.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_BACKENDS_SLEEPERS_HPP_
#define TAKT_EXECUTORS_WAIT_BACKENDS_SLEEPERS_HPP_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// An eventcount: of many announcements to a sleeper only the first one is a system call, and none
/// waits for a thread that was preempted:
/// 1. A thread begins, looks a last time for what there is to do, sleeps until it takes a post or
///    its time has come, and ends. All that it looks at is seq_cst.
/// 2. A thread writes what there is to do, and then wakes: if fewer are woken than sleep, it counts
///    one more as woken, and posts. In between it may be preempted, so it counts as posting.
/// 3. A thread that finds all sleepers woken posts nothing; but while another thread is posting, it
///    posts on behalf of that one (helping), and marks the word as helped. The mark holds until a
///    thread ends its sleep: the word counts these ends, so a late mark fails (no ABA).
/// 4. A thread that ends does not care whether a post is still coming. A post too many is a
///    spurious wake-up of a later sleep.
/// So a thread returns from `wake` only when a sleeper that will look afterwards has been posted
/// to.
///
/// Thread safety: begin and end from a thread that sleeps, the rest from any.
/// Real-time: nothing blocks; `wake` costs one load when nobody sleeps.
class Sleepers {
 public:
  void begin() noexcept { word_.fetch_add(kSleeping); }
  /// `has_taken`: the thread has taken a post.
  void end(bool has_taken) noexcept {
    std::uint64_t word = word_.load();
    std::uint64_t ended = 0;
    do {
      const std::uint64_t sleeping = word % kWoken - 1, woken = word / kWoken % kWoken;
      const std::uint64_t left = has_taken && woken != 0 ? woken - 1 : woken;
      ended = (word & ~kHelped) / kPosting * kPosting + kEnd + std::min(left, sleeping) * kWoken +
              sleeping;
    } while (!word_.compare_exchange_weak(word, ended));
  }

  /// Wakes one thread by `post()`. False: all were woken already.
  template <class Post>
  bool wake(Post&& post) noexcept {
    std::uint64_t word = word_.load();
    if (claim(word)) {
      post();
      word_.fetch_sub(kPosting);
      return true;
    }
    if (!must_help(word)) return false;
    post();
    word_.compare_exchange_strong(word, word + kHelped);
    return true;
  }
  template <class Post>
  void wake_all(Post&& post) noexcept {
    std::uint64_t word = word_.load();
    while (claim(word)) {
      post();
      word = word_.fetch_sub(kPosting) - kPosting;
    }
    if (word / kPosting % kWoken == 0) return;
    for (std::uint64_t woken = word / kWoken % kWoken; woken != 0; --woken) post();
  }
  /// Whether wake() would post.
  bool would_wake() const noexcept {
    const std::uint64_t word = word_.load();
    return idle_in(word) != 0 || must_help(word);
  }

  /// How many sleep that nobody has woken.
  std::size_t idle() const noexcept { return idle_in(word_.load()); }

 private:
  // One more is woken, and this thread is posting. False: all were.
  bool claim(std::uint64_t& word) noexcept {
    while (idle_in(word) != 0) {
      if (word_.compare_exchange_weak(word, word + kPosting + kWoken)) return true;
    }
    return false;
  }
  static std::size_t idle_in(std::uint64_t word) noexcept {
    return word % kWoken - word / kWoken % kWoken;
  }
  // All are woken, and a thread is posting for one.
  static bool must_help(std::uint64_t word) noexcept {
    return word / kPosting % kWoken != 0 && word % kWoken != 0 && (word & kHelped) == 0;
  }
  // The word counts threads that sleep, those of them that were woken, and those that are posting,
  // in 16 bits each; then whether a thread has helped; then ends of sleeps.
  static constexpr std::uint64_t kSleeping = 1, kWoken = 1 << 16, kPosting = kWoken << 16,
                                 kHelped = kPosting << 16, kEnd = kHelped << 1;
  alignas(64) std::atomic<std::uint64_t> word_{0};
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_BACKENDS_SLEEPERS_HPP_
