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
#include "takt/transport/dds/bounded_end.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/dds/loopback_sockets.hpp"
#include "takt/transport/shared_memory/refused_chunks.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

namespace takt {
namespace {

std::atomic<std::uint64_t> warnings{0};

thread_local std::string* kept = nullptr;

void log_sink(void*, const dds_log_data_t* data) {
  std::string_view text(data->message, data->size);
  while (text.ends_with('\n')) text.remove_suffix(1);
  if (kept != nullptr) {
    *kept = text;
    std::replace(kept->begin(), kept->end(), '\n', ' ');  // OpenSSL's
  } else if (!count_refused(text)) {
    complain(text);
  }
}

// Lean, deterministic, discovery over the loopback interface without multicast, messages up to
// the size of a datagram in one piece. One thread receives: several need no select() before each
// message, but Cyclone wakes them at its end by a datagram over the network, and waits for ever
// when the cable is cut.
std::string domain_configuration(const DdsOptions& options, std::uint64_t roudi) {
  const char* interfaces =
      options.loopback_only
          ? R"(<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast>)"
          : "";
  const char* peers = options.loopback_only ? R"(<Peers><Peer address="127.0.0.1"/></Peers>)" : "";
  std::string shared_memory = "<Enable>false</Enable>";
  if (roudi != 0) {
    // The locator says which processes share memory. For processes other than Takt's we do not know
    // the layout of their messages; those of other machines, and other RouDis, are not visible.
    shared_memory =
        "<Enable>true</Enable><LogLevel>fatal</LogLevel><Locator>74:61:6b:74:00:00:00:00";
    for (int byte = 0; byte < 8; ++byte) {
      shared_memory += fmt::format(":{:02x}", (roudi >> (8 * byte)) & 0xff);
    }
    shared_memory += fmt::format("</Locator><Prefix>takt_{}</Prefix>", options.domain);
  }
  return fmt::format(
      R"(<CycloneDDS><Domain id="any"><General>{}<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General>)"
      R"(<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>{}<LeaseDuration>2s</LeaseDuration></Discovery>)"
      R"(<Internal><SocketReceiveBufferSize min="default" max="10MB"/><Watermarks><WhcHigh>16MB</WhcHigh></Watermarks><MultipleReceiveThreads>false</MultipleReceiveThreads></Internal>)"
      R"(<SharedMemory>{}</SharedMemory></Domain></CycloneDDS>)",
      interfaces, peers, shared_memory);
}

// The RouDi that this process uses, once it has begun to: iceoryx binds a process to one.
std::uint64_t bind_to(const Roudi& roudi) {
  static std::atomic<std::uint64_t> bound{0};
  std::uint64_t before = 0;
  return bound.compare_exchange_strong(before, roudi.identity) ? roudi.identity : before;
}

}  // namespace

void complain(std::string_view text) {
  static constinit LogThrottle throttle;
  warnings.fetch_add(1, std::memory_order_relaxed);
  if (const auto left_out = throttle.may_log()) {
    // The count comes first, because long lines are cut.
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

std::string why_not(const Roudi& roudi) {
  if (!roudi.unusable.empty()) return roudi.unusable;
  if (bind_to(roudi) != roudi.identity) return "RouDi was started again after this process";
  return {};
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

Domain::Domain(const DdsOptions& options) {
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
  handle_ = check_joined(
      dds_create_domain(
          static_cast<dds_domainid_t>(options.domain),
          domain_configuration(options, why_no_shared_memory_.empty() ? roudi.identity : 0)
              .c_str()),
      fmt::format("DDS domain {} could not be set up", options.domain),
      "at most 100 processes of one machine can join a domain: choose another by "
      "`dds: {domain: N}`");
  if (why_no_shared_memory_.empty()) bound_exit();
  if (roudi.is_silent && options.shared_memory == SharedMemory::automatic) {
    log(LogLevel::warn, "{}; messages go by UDP", roudi.unusable);
  }
  if (!options.loopback_only) return;
  if (const std::string why = keep_on_loopback(options.domain); !why.empty()) complain(why);
}

void Domain::remove(dds_entity_t handle) const {
  why_no_shared_memory_.empty() ? delete_within_bound(handle) : void(dds_delete(handle));
}

std::uint64_t dds_warnings() noexcept {
  return warnings.load(std::memory_order_relaxed);
}

}  // namespace takt
