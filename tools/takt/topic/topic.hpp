// The parts of `takt topic`.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TOPIC_TOPIC_HPP_
#define TAKT_TOOLS_TAKT_TOPIC_TOPIC_HPP_

#include <cstdint>
#include <optional>
#include <string>

#include "graph/observer.hpp"

namespace takt::tools::topic_command {

struct Options : ObserverOptions {
  std::string topic, type, message = "{}";
  Nanoseconds duration{0}, wait_limit{0};
  double rate_hz = 0;
  std::uint64_t count = 0;
  std::optional<std::size_t> wanted_subscriptions;
  std::size_t window = 1000;
  bool full = false, raw = false, shows_types = false, verbose = false, counts = false;
};

// What discovery says.
void list(const Options& options);
void info(const Options& options);
void type(const Options& options);
void find(const Options& options);

// What the topic's messages say.
void echo(const Options& options);
void hz(const Options& options);
void bw(const Options& options);
void delay(const Options& options);

}  // namespace takt::tools::topic_command

#endif  // TAKT_TOOLS_TAKT_TOPIC_TOPIC_HPP_
