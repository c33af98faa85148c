// A gate that permits or stops the callbacks of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_CALLBACK_GATE_HPP_
#define TAKT_NODES_CALLBACK_GATE_HPP_

#include <atomic>
#include <cstdint>

#include "takt/base/visibility.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace TAKT_PUBLIC takt {

/// Shared by the managed entities of one LifecycleNode. It begins closed.
///
/// The protocol:
/// 1. An entity that is about to take something reserves; a gate that closes, or is closed,
///    refuses, and nothing is taken. So what is not served stays where it is.
/// 2. What was taken is executed: the reservation becomes a Passage, which ends with the callback.
///    Or it is discarded: the reservation is given back.
/// 3. Closing the gate first refuses further reservations, then waits until all others have ended,
///    except for the passages of the calling thread, within which it closes the gate. If one of
///    another thread waits for this one (WaitInCallback), it waits for none.
/// 4. An executor that takes all inputs of a period before it runs the first callback (logical
///    execution time) holds reservations that cannot end while one of these callbacks closes the
///    gate, or waits. They are not waited for; they become no passages any more.
///
/// Thread safety: every method from any thread; open and close one at a time.
/// Real-time: close blocks; nothing else does, and nothing allocates. A callback costs three atomic
/// additions.
class CallbackGate {
 public:
  CallbackGate() = default;
  CallbackGate(const CallbackGate&) = delete;
  CallbackGate& operator=(const CallbackGate&) = delete;

  /// Whether something may be taken.
  bool is_open() const noexcept { return (state_.load() & kClosing) == 0; }
  /// Whether it has been closed and all passages have ended that closing waits for.
  bool is_closed() const noexcept { return (state_.load() & kClosed) != 0; }
  /// How often it has been closed, the beginning included.
  std::uint32_t closings() const noexcept { return closings_.load(std::memory_order_relaxed); }

  /// A true answer is followed by a Passage or by give_back, on the same thread.
  bool reserve() noexcept;
  void give_back() noexcept;

  /// A reserved callback that runs, for as long as the object lives. False: it must not run.
  class Passage {
   public:
    explicit Passage(CallbackGate& gate) noexcept
        : gate_(gate.enter() ? &gate : nullptr), running_(gate_) {}
    ~Passage() {
      if (gate_ != nullptr) gate_->leave(kRunning);
    }
    Passage(const Passage&) = delete;
    Passage& operator=(const Passage&) = delete;
    explicit operator bool() const noexcept { return gate_ != nullptr; }

   private:
    CallbackGate* const gate_;
    const detail::Running running_;
  };
  /// The calling thread holds the reservations of a period while callbacks run, for as long as the
  /// object lives.
  class Period {
    const detail::Running running_{&kPeriod};
  };

  void open() noexcept { state_.fetch_and(~(kClosing | kClosed)); }
  /// Afterwards no callback runs, but those that the calling thread is in, or that wait for it.
  void close() noexcept;

 private:
  // One word, so that a futex serves: two flags, and two counters of 15 bits.
  static constexpr std::uint32_t kClosing = 1, kClosed = 2, kReserved = 1u << 2,
                                 kRunning = 1u << 17;
  static constexpr std::uint32_t reserved(std::uint32_t state) noexcept {
    return (state % kRunning) / kReserved;
  }
  static constexpr std::uint32_t running(std::uint32_t state) noexcept { return state / kRunning; }
  bool enter() noexcept;
  void leave(std::uint32_t counted) noexcept;

  static constexpr char kPeriod = 0;  // its address
  std::atomic<std::uint32_t> state_{kClosing | kClosed};
  std::atomic<std::uint32_t> closings_{1};
  // The reservations of the calling thread, at all gates.
  static thread_local constinit int held_;
};

}  // namespace takt

#endif  // TAKT_NODES_CALLBACK_GATE_HPP_
