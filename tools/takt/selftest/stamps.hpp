// The component that takt selftest compares the statistics with.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_STAMPS_HPP_
#define TAKT_TOOLS_TAKT_STAMPS_HPP_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/nodes/node.hpp"

namespace takt::tools {

/// A message with its number, and two times in ns of CLOCK_MONOTONIC: when it was published, and
/// when the timer was due that published it (0: not known).
template <std::size_t Bytes>
struct Stamped {
  std::uint64_t number = 0;
  std::int64_t sent_ns = 0, due_ns = 0;
  std::array<std::byte, Bytes> data{};
};
inline constexpr std::size_t kSmallBytes = 40, kLargeBytes = 5'000'000;
TAKT_MESSAGE(Stamped<kSmallBytes>, "takt/msg/StampedSmall", number, sent_ns, due_ns, data);
TAKT_MESSAGE(Stamped<kLargeBytes>, "takt/msg/StampedLarge", number, sent_ns, due_ns, data);

/// The component `takt::Stamps`. It sends itself small messages at 1 kHz, large ones at 20 Hz, and
/// more at once than their queue holds, on the topics `small`, `large` and `burst`. It reads the
/// clock before it publishes, as the first thing in a callback, and as the last one: so it knows
/// every time without any statistics. In the callbacks of large messages it uses `work_us` of CPU
/// time (0), and in some of small ones, which have a deadline. When it goes, it writes what it has
/// seen to the file in the parameter `file`.
/// Thread safety and real-time: as Node; its vectors have their room from the start.
class Stamps : public Node {
 public:
  static constexpr Nanoseconds kDeadline = std::chrono::milliseconds(1);

  explicit Stamps(const NodeOptions& options);
  ~Stamps();

 private:
  void write_books() const;
  /// What the callback of a message has seen.
  struct Received {
    std::uint64_t number;
    std::int64_t sent_ns, due_ns, start_ns, end_ns;
    bool was_preempted;  // the thread, since its callback before
  };
  struct Topic {
    std::vector<bool> sent;  // each: whether the thread was preempted while it published
    std::vector<Received> received;
    std::int64_t next_due_ns = 0;
    std::shared_ptr<Timer> timer;
    std::shared_ptr<Entity> subscription;
  };
  template <class Message>
  void publish(Publisher<Message>& publisher, Topic& topic) noexcept;
  template <class Message>
  void exchange(const std::string& name, std::size_t depth, Nanoseconds period, int at_once,
                Topic& topic);
  void work(std::uint64_t number, bool is_large) const noexcept;
  void sample_thread() noexcept;

  const std::string file_;
  const Nanoseconds work_;
  Topic small_, large_, burst_;
  // Of the thread of the small messages' timer, as the kernel counts: the first time, the last.
  struct Sample {
    std::int64_t time_ns = 0, cpu_ns = 0;
    std::int64_t wakeups = 0;
  };
  Sample first_, last_;
  std::uint64_t ticks_ = 0;
  std::uint64_t pss_kb_ = 0;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_STAMPS_HPP_
