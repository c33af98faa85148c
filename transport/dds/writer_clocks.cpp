// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/writer_clocks.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <string_view>

#include <fmt/format.h>

#include "takt/base/clock.hpp"

namespace takt {

std::string clock_identity() {
  static const std::string identity = [] {
    std::string boot;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
    return boot.empty() ? "" : "takt_clock=" + boot + ";";
  }();
  return identity;
}

bool WriterClocks::is_ours(dds_entity_t reader, dds_instance_handle_t writer) {
  const auto known = std::find_if(known_.begin(), known_.end(),
                                  [&](const auto& entry) { return entry.first == writer; });
  if (known != known_.end()) return known->second;
  bool is_ours = false;
  if (dds_builtintopic_endpoint_t* const data = dds_get_matched_publication_data(reader, writer)) {
    void* bytes = nullptr;
    std::size_t size = 0;
    if (dds_qget_userdata(data->qos, &bytes, &size) && bytes != nullptr) {
      const std::string_view text(static_cast<const char*>(bytes), size);
      const std::string ours = clock_identity();
      is_ours = !ours.empty() && text.find(ours) != std::string_view::npos;
      dds_free(bytes);
    }
    dds_builtintopic_free_endpoint(data);
  }
  if (known_.size() == kMostKnown) known_.clear();
  known_.emplace_back(writer, is_ours);
  return is_ours;
}

TimePoint WriterClocks::sent_at(dds_entity_t reader, const dds_sample_info_t& info) {
  const TimePoint now = Clock::steady().now();
  if (!are_synchronized_ && !is_ours(reader, info.publication_handle)) return now;
  const Nanoseconds age(dds_time() - info.source_timestamp);
  return now - std::max(age, Nanoseconds::zero());
}

}  // namespace takt
