// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/writer_clocks.hpp"

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"

namespace takt {

namespace {

constexpr std::string_view kClockKey = "taktclock";

const std::string& boot_id() {
  static const std::string id = [] {
    std::string boot;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
    return boot;
  }();
  return id;
}

}  // namespace

std::string clock_identity() {
  return boot_id().empty() ? std::string() : fmt::format("{}={};", kClockKey, boot_id());
}

const WriterClocks::Writer& WriterClocks::writer(dds_entity_t reader,
                                                 dds_instance_handle_t handle) {
  const auto known = std::find_if(known_.begin(), known_.end(),
                                  [&](const Writer& each) { return each.handle == handle; });
  if (known != known_.end()) return *known;
  if (known_.size() == kMostKnown) known_.clear();
  Writer& added = known_.emplace_back(Writer{.handle = handle});
  if (dds_builtintopic_endpoint_t* const data = dds_get_matched_publication_data(reader, handle)) {
    const std::string theirs = user_data_value(*data->qos, kClockKey);
    added.has_our_clock = !theirs.empty() && theirs == boot_id();
    added.lifespan = qos_of(*data->qos).lifespan_duration;
    dds_builtintopic_free_endpoint(data);
  }
  return added;
}

WriterClocks::Times WriterClocks::times_of(dds_entity_t reader, const dds_sample_info_t& info) {
  // Reads the clocks first, as the question to Cyclone takes time.
  const ClockPair now =
      read_together([] { return Clock::steady().now(); }, [] { return Nanoseconds(dds_time()); });
  const Writer& from = writer(reader, info.publication_handle);
  Times times{now.steady, kNever};
  if (are_synchronized_ || from.has_our_clock) {
    const Nanoseconds age = now.wall - Nanoseconds(info.source_timestamp);
    times.sent -= std::max(age, Nanoseconds::zero());
  }
  if (from.lifespan != Nanoseconds::zero()) times.expiry = later(times.sent, from.lifespan);
  return times;
}

}  // namespace takt
