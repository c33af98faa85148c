// A DDS domain of this process, and what Cyclone says while it is joined.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_DOMAIN_HPP_
#define TAKT_TRANSPORT_DDS_DOMAIN_HPP_

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <dds/dds.h>

#include "takt/transport/dds/newcomers.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {

/// The last one that there is. The ports of the next ones would leave the range of ports.
inline constexpr int kLastDomain = 230;

/// Counts a complaint of Cyclone's, and logs one a second.
void complain(std::string_view text);

/// While it lives, what Cyclone complains of on this thread is kept, and not logged: on a thread
/// that joins a domain it is the reason if that fails.
class KeptComplaint {
 public:
  KeptComplaint();
  ~KeptComplaint();
  KeptComplaint(const KeptComplaint&) = delete;
  KeptComplaint& operator=(const KeptComplaint&) = delete;
  /// The last one; empty: none.
  std::string text;
};

/// As dds_check, with the complaint that this thread keeps.
dds_entity_t check_joined(dds_return_t result, const std::string& what,
                          const std::string& what_to_do);

/// A process has one of each number, made at the first request.
class Domain {
 public:
  static std::shared_ptr<Domain> get(const DdsOptions& options);
  explicit Domain(const DdsOptions& options);
  ~Domain();
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  const std::string& why_no_shared_memory() const noexcept { return why_no_shared_memory_; }
  /// Deletes an entity of the domain.
  void remove(dds_entity_t handle) const;

 private:
  std::string why_no_shared_memory_;
  const bool has_data_thread_;
  dds_entity_t handle_;
  std::optional<Newcomers> newcomers_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_DOMAIN_HPP_
