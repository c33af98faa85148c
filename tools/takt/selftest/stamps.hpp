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

/// A message with the time at which it was published, in ns of CLOCK_MONOTONIC.
template <std::size_t Bytes>
struct Stamped {
  std::int64_t stamp_ns = 0;
  std::array<std::byte, Bytes> data{};
};
inline constexpr std::size_t kSmallBytes = 56, kLargeBytes = 1'000'000;
TAKT_MESSAGE(Stamped<kSmallBytes>, "takt/msg/StampedSmall", stamp_ns, data);
TAKT_MESSAGE(Stamped<kLargeBytes>, "takt/msg/StampedLarge", stamp_ns, data);

/// The component `takt::Stamps`: sends itself small messages at 1 kHz, and large ones at 50 Hz, on
/// the topics `small` and `large`. It reads the clock before it publishes, and again as the first
/// thing in the callback; so it knows every latency without any statistics. In the callback of a
/// large message it uses `work_us` of CPU time (0). When it goes, it writes what it has seen to the
/// file in the parameter `file`.
/// Thread safety and real-time: as Node; its vectors have their room from the start.
class Stamps : public Node {
 public:
  explicit Stamps(const NodeOptions& options);
  ~Stamps();

 private:
  struct Topic {
    std::uint64_t sent = 0;
    std::vector<std::int64_t> latencies_ns;
  };
  template <std::size_t Bytes>
  void exchange(const std::string& name, Nanoseconds period, Topic& topic);
  void sample_thread() noexcept;

  const std::string file_;
  const Nanoseconds work_;
  Topic small_, large_;
  // Of the thread of the small messages' timer, as the kernel counts: the first time, the last.
  struct Sample {
    std::int64_t time_ns = 0, cpu_ns = 0;
    std::int64_t wakeups = 0;
  };
  Sample first_, last_;
  std::uint64_t ticks_ = 0;
  std::vector<std::shared_ptr<void>> entities_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_STAMPS_HPP_
