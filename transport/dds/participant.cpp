// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/participant.hpp"

#include <charconv>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/transport/dds/cyclone_participant.hpp"

namespace takt {

void DdsOptions::check() const {
  if (threads.policy == ThreadPolicy::deadline) {
    throw Error("the threads of DDS inherit their policy, and a reservation is not inherited",
                "choose another policy than SCHED_DEADLINE for them");
  }
  if (security && shared_memory == SharedMemory::require) {
    throw Error("shared memory is required, and what lies there is not secured",
                "leave out one of `shared_memory` and `security`");
  }
}

std::shared_ptr<Participant> Participant::create(const DdsOptions& options) {
  options.check();
  if (options.security) options.security->check();
  put_away(nullptr);
  return std::make_shared<CycloneParticipant>(options);
}

int default_domain() {
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == 0) return 0;
  int domain = -1;
  const char* const text_end = text + std::strlen(text);
  const auto [end, error] = std::from_chars(text, text_end, domain);
  if (error != std::errc{} || end != text_end || domain < 0 || domain > kLastDomain) {
    throw Error(fmt::format("ROS_DOMAIN_ID is '{}'", text),
                fmt::format("set it to a number from 0 to {}", kLastDomain));
  }
  return domain;
}

}  // namespace takt
