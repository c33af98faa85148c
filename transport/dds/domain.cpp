// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/domain.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include <dds/ddsrt/log.h>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/dds/domain_configuration.hpp"
#include "takt/transport/dds/loopback_sockets.hpp"
#include "takt/transport/dds/room.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

// Limit: attempts to take a port of the domain. At it: joining fails. Seen: the error.
constexpr int kMostAttempts = 120;  // others may join at the same time

std::atomic<std::uint64_t> warnings{0};

thread_local std::string* kept = nullptr;

void log_sink(void*, const dds_log_data_t* data) {
  std::string_view text(data->message, data->size);
  while (text.ends_with('\n')) text.remove_suffix(1);
  if (kept != nullptr) {
    *kept = text;
    std::replace(kept->begin(), kept->end(), '\n', ' ');  // errors of OpenSSL have several lines
  } else if (!count_refused(text)) {
    complain(text);
  }
}

struct Joined {
  dds_entity_t handle;
  int participant_index;
};

Joined join(const DdsOptions& options, std::uint64_t roudi) {
  check_room(roudi == 0 ? 0 : shared_memory_bytes());
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    const auto index = free_participant_index(options);
    if (!index) break;
    const dds_entity_t handle =
        dds_create_domain(static_cast<dds_domainid_t>(options.domain),
                          domain_configuration(options, *index, roudi).c_str());
    if (handle < 0 && free_participant_index(options) != index) {
      kept->clear();  // another process took the index
      continue;
    }
    check_joined(handle, fmt::format("DDS domain {} could not be set up", options.domain),
                 "check the network interfaces, and CYCLONEDDS_URI if it is set");
    return {handle, *index};
  }
  throw Error(
      fmt::format("DDS domain {} is full: it has no port left for this process", options.domain),
      "at most 115 processes of one machine can join a domain: choose another by "
      "`dds: {domain: N}`");
}

}  // namespace

void complain(std::string_view text) {
  static constinit LogThrottle throttle;
  warnings.fetch_add(1, std::memory_order_relaxed);
  if (const auto left_out = throttle.may_log()) {
    // The count comes first, as long lines are cut at the end.
    log(LogLevel::warn, "DDS{}: {}",
        *left_out == 0 ? "" : fmt::format(" (and {} others before)", *left_out), text);
  }
}

KeptComplaint::KeptComplaint() {
  kept = &text;
}

KeptComplaint::~KeptComplaint() {
  kept = nullptr;
}

dds_entity_t check_joined(dds_return_t result, const std::string& what,
                          const std::string& what_to_do) {
  if (result < 0 && !kept->empty()) throw Error(what + ": " + *kept, what_to_do);
  return dds_check(result, what, what_to_do);
}

std::shared_ptr<Domain> Domain::get(const DdsOptions& options) {
  static std::mutex mutex;
  static std::map<int, std::weak_ptr<Domain>> domains;
  const std::lock_guard lock(mutex);
  std::weak_ptr<Domain>& known = domains[options.domain];
  std::shared_ptr<Domain> domain = known.lock();
  if (domain == nullptr) known = domain = std::make_shared<Domain>(options);
  return domain;
}

Domain::Domain(const DdsOptions& options) : has_data_thread_(has_data_thread(options)) {
  if (options.domain < 0 || options.domain > kLastDomain) {
    throw Error(fmt::format("there is no DDS domain {}", options.domain),
                fmt::format("choose a number from 0 to {}", kLastDomain));
  }
  dds_set_log_sink(log_sink, nullptr);
  const Roudi roudi = find_roudi();
  why_no_shared_memory_ = options.shared_memory == SharedMemory::off
                              ? "switched off when this process joined the domain"
                          : options.security ? "what lies in shared memory is not secured"
                                             : why_not(roudi);
  const Joined joined = join(options, why_no_shared_memory_.empty() ? roudi.identity : 0);
  handle_ = joined.handle;
  newcomers_.emplace(options.discovery, options.domain, joined.participant_index);
  if (why_no_shared_memory_.empty()) bound_exit();
  if (roudi.is_silent && options.shared_memory == SharedMemory::automatic) {
    log(LogLevel::warn, "{}; messages go by UDP", roudi.unusable);
  }
  if (options.discovery != DiscoveryRange::lo) return;
  if (const std::string why = keep_on_loopback(options.domain); !why.empty()) complain(why);
}

Domain::~Domain() {
  newcomers_.reset();
  if (!has_data_thread_ || is_loopback_up()) {
    remove(handle_);
  } else {
    log(LogLevel::error,
        "DDS: Cyclone's threads cannot be ended, as the loopback interface is down: ip link set lo "
        "up");
  }
}

void Domain::remove(dds_entity_t handle) const {
  why_no_shared_memory_.empty() ? delete_within_bound(handle) : void(dds_delete(handle));
}

std::uint64_t dds_warnings() noexcept {
  return warnings.load(std::memory_order_relaxed);
}

}  // namespace takt
