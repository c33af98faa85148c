// A bounded ring that keeps the newest items: several publishers, several takers, no lock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_KEEP_LAST_RING_HPP_
#define TAKT_BASE_LOCKFREE_KEEP_LAST_RING_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Pointers to items in order of arrival; a push into a full ring gives back the oldest.
///
/// A cell is one 64-bit word: the low 16 bits of the ticket it was last used for, and a 48-bit
/// pointer (user addresses have 47 bits on x86-64 and 48 on AArch64).
/// 1. A publisher draws a ticket from the tail and swaps the cell of an older ticket for its own,
///    with one compare-and-swap; what stood there is the item that it overwrote.
/// 2. A taker looks at the cell of the head's ticket and swaps it for the same ticket without a
///    pointer. It never looks at an item before it owns it, so an item may be freed at any time.
///    Beside the word, the cell holds the whole ticket. If that is the head's, the taker needs no
///    look at the tail to know that it was not overtaken, and leaves that cache line to the
///    publishers. Of the tail it keeps a copy, good for as long as that says that there is more.
/// 3. A publisher that was preempted between its ticket and its swap delays no other: the taker
///    stamps the cell with the ticket, the swap fails, and the publisher draws another ticket.
///    So does one that finds at its return that the tail is too far ahead to compare tickets.
///    (Preempted between that look and the swap, it may find the very same word 65,536 tickets
///    later: then its item takes the place of a newer one, which is given back. None is lost.)
/// 4. A publisher on the taker's own thread, while nothing waits, needs no ticket: the item lies
///    beside the cells, and is older than all that come into them before it is taken. It counts
///    as one of `depth`: when as many tickets were drawn since, it is dropped.
/// docs/explanation/decisions/0002_own_queues.md says why this is not a Boost.Lockfree queue.
///
/// Thread safety: every method may be called from any thread, but push_here only from the one that
/// takes; the destructor frees no items.
/// Real-time: push, pop and front are lock-free; nothing allocates after construction.
/// With N cells in use, at most N steps pass over cells that others changed meanwhile.
template <class T>
class KeepLastRing {
 public:
  /// The ticket in a cell has 16 bits, so half of that range separates older from newer.
  // Limit: messages in the ring of a subscription, the largest `depth`. At it: a larger depth is
  // refused; a full ring overwrites its oldest message. Seen: the error; `dropped`.
  static constexpr std::size_t kMaxDepth = 16384;

  /// `depth` is from 1 to kMaxDepth; QoS checks it with an Error that the user sees.
  explicit KeepLastRing(std::size_t depth)
      : depth_(depth), is_power_of_two_((depth & (depth - 1)) == 0), cells_(new Cell[depth]) {
    for (std::size_t i = 0; i < depth; ++i) cells_[i].word = pack(i - depth, nullptr);
  }

  /// Returns the item that was overwritten, or nullptr. `front` returns the three numbers while the
  /// item waits. (Numbers, no struct: one that is written by fields and copied whole is read only
  /// when the writes have left the store buffer.)
  T* push(T* item, std::uint64_t sequence, std::int64_t time_ns,
          std::int64_t root_time_ns = 0) noexcept {
    for (;;) {
      const std::uint64_t ticket = tail_.fetch_add(1);
      Cell& cell = cell_of(ticket);
      std::uint64_t word = cell.word.load(std::memory_order_acquire);  // pairs with the swaps
      while (age(word, ticket) > 0 && !is_far(ticket)) {
        // Relaxed: published by the swap; one that fails to swap leaves a wrong hint there.
        cell.ticket.store(ticket, std::memory_order_relaxed);
        cell.sequence.store(sequence, std::memory_order_relaxed);
        cell.time_ns.store(time_ns, std::memory_order_relaxed);
        cell.root_time_ns.store(root_time_ns, std::memory_order_relaxed);
        if (cell.word.compare_exchange_weak(word, pack(ticket, item))) {
          T* overwritten = pointer(word);
          return here_.load(std::memory_order_relaxed) == nullptr ? overwritten
                                                                  : make_room(ticket, overwritten);
        }
      }
      lost_tickets_.fetch_add(1, std::memory_order_relaxed);  // a statistic, ordered by nothing
    }
  }

  /// The same on the thread that takes, which is faster when nothing waits. If others take too, one
  /// of them may come away with a newer item first.
  T* push_here(T* item, std::uint64_t sequence, std::int64_t time_ns,
               std::int64_t root_time_ns = 0) noexcept {
    const std::uint64_t ticket = tail_.load(std::memory_order_relaxed);
    if (ticket != head_.load(std::memory_order_relaxed) ||
        here_.load(std::memory_order_relaxed) != nullptr) {
      return push(item, sequence, time_ns, root_time_ns);
    }
    here_ticket_.store(ticket, std::memory_order_relaxed);
    here_sequence_.store(sequence, std::memory_order_relaxed);
    here_time_ns_.store(time_ns, std::memory_order_relaxed);
    here_root_time_ns_.store(root_time_ns, std::memory_order_relaxed);
    here_.store(item, std::memory_order_release);  // pairs with the taker's swap
    here_pushed_.store(here_pushed_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return nullptr;
  }

  /// How many items were pushed so far; exact when no thread pushes.
  std::uint64_t pushed() const noexcept {
    return tail_.load(std::memory_order_relaxed) - lost_tickets_.load(std::memory_order_relaxed) +
           here_pushed_.load(std::memory_order_relaxed);
  }

  /// The oldest item, or nullptr when there is none. `dropped` is called with items that were
  /// overwritten by publishers that have not finished yet. `more` says whether there was more.
  template <class Dropped>
  T* pop(Dropped&& dropped, bool& more) noexcept {
    if (T* item = take_here()) {
      const std::uint64_t tail = tail_.load();
      if (tail - here_ticket_.load(std::memory_order_relaxed) < depth_) {
        more = tail != head_.load(std::memory_order_relaxed);
        return item;
      }
      dropped(item);  // publishers that did not see it have filled the cells
    }
    const std::uint64_t ticket = head_.load(std::memory_order_relaxed);  // a hint
    Cell& cell = cell_of(ticket);
    std::uint64_t word = cell.word.load(std::memory_order_acquire);  // pairs with push's swap
    if (!cell.holds(word, ticket)) return search(dropped, more);
    more = known_tail_.load(std::memory_order_relaxed) > ticket + 1 || look_at_tail() > ticket + 1;
    if (!cell.word.compare_exchange_strong(word, pack(ticket, nullptr))) {
      return search(dropped, more);
    }
    head_.store(ticket + 1, std::memory_order_relaxed);
    return pointer(word);
  }

  /// What was passed to push with the oldest item; false when there is none, or its publisher has
  /// not finished. While publishers overwrite, it may be that of the item that took its place.
  bool front(std::uint64_t& sequence, std::int64_t& time_ns,
             std::int64_t& root_time_ns) const noexcept {
    if (here_.load(std::memory_order_acquire) != nullptr) {
      sequence = here_sequence_.load(std::memory_order_relaxed);
      time_ns = here_time_ns_.load(std::memory_order_relaxed);
      root_time_ns = here_root_time_ns_.load(std::memory_order_relaxed);
      return true;
    }
    for (std::uint64_t ticket = head_.load(std::memory_order_relaxed);; ++ticket) {
      const Cell& cell = cell_of(ticket);
      const std::uint64_t word = cell.word.load(std::memory_order_acquire);
      if (cell.holds(word, ticket)) {
        sequence = cell.sequence.load(std::memory_order_relaxed);
        time_ns = cell.time_ns.load(std::memory_order_relaxed);
        root_time_ns = cell.root_time_ns.load(std::memory_order_relaxed);
        return true;
      }
      const std::uint64_t tail = tail_.load();
      if (ticket == tail) return false;
      if (tail - ticket > depth_) {
        ticket = tail - depth_ - 1;  // overtaken
      } else if (age(word, ticket) > 0) {
        return false;
      }
    }
  }

  /// An upper bound; exact when no thread pushes or pops. Sequentially consistent with push: a
  /// taker that reads 0 after it announced that it goes away will be announced to again.
  std::size_t size() const noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    const std::uint64_t waiting =
        tail_.load() - head + (here_.load(std::memory_order_relaxed) != nullptr ? 1 : 0);
    // Another taker's stale store may have moved the hint back; the ring holds depth at most.
    return waiting < depth_ ? waiting : depth_;
  }

  std::size_t depth() const noexcept { return depth_; }

 private:
  struct Cell {
    std::atomic<std::uint64_t> word{0};
    // Of the last swap, or of one that is about to happen.
    std::atomic<std::uint64_t> ticket{0}, sequence{0};
    std::atomic<std::int64_t> time_ns{0}, root_time_ns{0};

    /// True: the item of just this ticket is in the word, which was loaded before.
    bool holds(std::uint64_t loaded, std::uint64_t of_ticket) const noexcept {
      const std::uint64_t item = loaded ^ pack(of_ticket, nullptr);
      return item - 1 < kPointerMask && ticket.load(std::memory_order_relaxed) == of_ticket;
    }
  };

  static constexpr std::uint64_t kPointerMask = (std::uint64_t{1} << 48) - 1;

  static std::uint64_t pack(std::uint64_t ticket, T* item) noexcept {
    return (ticket << 48) | (reinterpret_cast<std::uintptr_t>(item) & kPointerMask);
  }
  static T* pointer(std::uint64_t word) noexcept {
    return reinterpret_cast<T*>(word & kPointerMask);
  }
  /// Positive when the cell was last used for an older ticket, negative for a newer one.
  static int age(std::uint64_t word, std::uint64_t ticket) noexcept {
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(ticket) -
                                     static_cast<std::uint16_t>(word >> 48));
  }
  /// Asked after the word was loaded: true when `age` may err, because its caller was preempted
  /// for so long that the word may be of a ticket outside the range of 16 bits.
  bool is_far(std::uint64_t ticket) const noexcept { return tail_.load() - ticket > 32768; }
  T* take_here() noexcept {
    return here_.load(std::memory_order_relaxed) == nullptr ? nullptr : here_.exchange(nullptr);
  }
  // After a push into the cells: gives back the item beside them when it is one too many. It is the
  // oldest, unless it has come since: then it may even have a later ticket.
  [[gnu::noinline]] T* make_room(std::uint64_t ticket, T* overwritten) noexcept {
    T* here = here_.load(std::memory_order_acquire);  // pairs with push_here
    const auto newer =
        static_cast<std::int64_t>(ticket + 1 - here_ticket_.load(std::memory_order_relaxed));
    const bool is_too_old =
        overwritten == nullptr && here != nullptr && newer >= static_cast<std::int64_t>(depth_);
    return is_too_old && here_.compare_exchange_strong(here, nullptr) ? here : overwritten;
  }
  std::uint64_t look_at_tail() noexcept {
    const std::uint64_t tail = tail_.load();
    known_tail_.store(tail, std::memory_order_relaxed);
    return tail;
  }
  Cell& cell_of(std::uint64_t ticket) const noexcept {
    return cells_[is_power_of_two_ ? ticket & (depth_ - 1) : ticket % depth_];
  }

  // When the head's cell does not hold its ticket's item: the ring is empty, or publishers have
  // overtaken the head, or one of them has not finished. Not inline: the usual case needs no loop.
  template <class Dropped>
  [[gnu::noinline]] T* search(Dropped&& dropped, bool& more) noexcept {
    std::uint64_t ticket = head_.load(std::memory_order_relaxed);  // a hint; the cells decide
    for (;;) {
      const std::uint64_t tail = look_at_tail();
      if (tail - ticket > depth_) ticket = tail - depth_;
      if (ticket == tail) break;
      Cell& cell = cell_of(ticket);
      std::uint64_t word = cell.word.load(std::memory_order_acquire);  // pairs with push's swap
      if (is_far(ticket)) continue;
      const int cell_age = age(word, ticket);
      if (cell_age < 0 || (cell_age == 0 && pointer(word) == nullptr)) {
        ++ticket;  // overwritten, or already taken
      } else if (cell.word.compare_exchange_strong(word, pack(ticket, nullptr))) {
        if (cell_age == 0) {
          head_.store(ticket + 1, std::memory_order_relaxed);
          more = ticket + 1 != tail;
          return pointer(word);
        }
        if (pointer(word) != nullptr) dropped(pointer(word));
      }
    }
    head_.store(ticket, std::memory_order_relaxed);
    more = false;
    return nullptr;
  }

  const std::size_t depth_;
  const bool is_power_of_two_;
  const std::unique_ptr<Cell[]> cells_;
  std::atomic<T*> here_{nullptr};  // see 4.; only the taker's thread sets it
  std::atomic<std::uint64_t> here_ticket_{0}, here_sequence_{0}, here_pushed_{0};
  std::atomic<std::int64_t> here_time_ns_{0}, here_root_time_ns_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // publishers write it
  std::atomic<std::uint64_t> lost_tickets_{0};      // see 3.
  alignas(64) std::atomic<std::uint64_t> head_{0};  // takers write it
  std::atomic<std::uint64_t> known_tail_{0};        // a copy for takers, as of some time ago
};

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_KEEP_LAST_RING_HPP_
