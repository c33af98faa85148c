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

bool WriterClocks::is_ours(dds_entity_t reader, dds_instance_handle_t writer) {
  const auto known = std::find_if(known_.begin(), known_.end(),
                                  [&](const auto& entry) { return entry.first == writer; });
  if (known != known_.end()) return known->second;
  bool is_ours = false;
  if (dds_builtintopic_endpoint_t* const data = dds_get_matched_publication_data(reader, writer)) {
    const std::string theirs = user_data_value(*data->qos, kClockKey);
    is_ours = !theirs.empty() && theirs == boot_id();
    dds_builtintopic_free_endpoint(data);
  }
  if (known_.size() == kMostKnown) known_.clear();
  known_.emplace_back(writer, is_ours);
  return is_ours;
}

TimePoint WriterClocks::sent_at(dds_entity_t reader, const dds_sample_info_t& info) {
  // Reads the clocks first, as the question to Cyclone takes time.
  const ClockPair now =
      read_together([] { return Clock::steady().now(); }, [] { return Nanoseconds(dds_time()); });
  if (!are_synchronized_ && !is_ours(reader, info.publication_handle)) return now.steady;
  const Nanoseconds age = now.wall - Nanoseconds(info.source_timestamp);
  return now.steady - std::max(age, Nanoseconds::zero());
}

}  // namespace takt
