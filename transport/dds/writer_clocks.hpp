// When messages of other processes were sent, and when they are too old.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_WRITER_CLOCKS_HPP_
#define TAKT_TRANSPORT_DDS_WRITER_CLOCKS_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include <dds/dds.h>

#include "takt/base/time.hpp"

namespace takt {

/// What an endpoint of ours carries in its user data, "taktclock=...;": equal for all processes
/// under one kernel, and so with one CLOCK_REALTIME.
std::string clock_identity();

/// CLOCK_MONOTONIC and CLOCK_REALTIME at one instant.
struct ClockPair {
  TimePoint steady;
  Nanoseconds wall;
};
/// Reads the clocks one after the other; again, a few times, if the thread was preempted in
/// between. The pair is of readings that lie close together: the second is never before the first.
template <class Steady, class Wall>
ClockPair read_together(Steady&& steady, Wall&& wall) {
  // Limit: readings of both clocks until two are close. At it: the closest pair counts. Seen:
  // nothing.
  constexpr int kMostReadings = 4;
  constexpr Nanoseconds kClose(1000);
  ClockPair closest{};
  Nanoseconds least = Nanoseconds::max();
  for (int i = 0; i < kMostReadings && least > kClose; ++i) {
    const ClockPair pair{steady(), wall()};
    const Nanoseconds apart = steady() - pair.steady;
    if (apart >= least) continue;
    least = apart;
    closest = pair;
  }
  return closest;
}

/// Turns the time stamps of one reader's messages into times of CLOCK_MONOTONIC. Messages carry
/// CLOCK_REALTIME of the host that sent them. A difference of wall clocks must not decide about
/// deadlines: so the stamp counts only where writer and reader share the clock.
/// Thread safety: for the one thread that takes the reader's messages.
/// Real-time: for threads of DDS; the first message of a writer asks Cyclone, and allocates.
class WriterClocks {
 public:
  /// `are_synchronized`: other hosts keep the same time (PTP), so their stamps count too.
  explicit WriterClocks(bool are_synchronized) : are_synchronized_(are_synchronized) {}

  /// Times of CLOCK_MONOTONIC.
  struct Times {
    TimePoint sent;    // on another host's clock: when it arrived. Never later
    TimePoint expiry;  // by its writer's lifespan; kNever: none
  };
  Times times_of(dds_entity_t reader, const dds_sample_info_t& info);

 private:
  struct Writer {
    dds_instance_handle_t handle;
    bool has_our_clock = false;
    Nanoseconds lifespan{0};  // 0: none
  };
  const Writer& writer(dds_entity_t reader, dds_instance_handle_t handle);

  // Limit: publishers of which a subscription knows their clock and lifespan. At it: all are
  // forgotten, and looked up again. Seen: nothing.
  static constexpr std::size_t kMostKnown = 64;
  const bool are_synchronized_;
  std::vector<Writer> known_;  // forgotten when it is full
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_WRITER_CLOCKS_HPP_
