// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <vector>

#include "takt/base/logger.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

struct Readers {
  std::mutex mutex;
  std::vector<SharedReader*> all;
};

Readers& readers() {
  static detail::NeverDestroyed<Readers> readers;
  return *readers;
}

}  // namespace

void SharedReader::register_reader() {
  const std::lock_guard lock(readers().mutex);
  readers().all.push_back(this);
}

void SharedReader::unregister_reader() noexcept {
  const std::lock_guard lock(readers().mutex);
  std::erase(readers().all, this);
}

std::size_t shared_reader_count() noexcept {
  const std::lock_guard lock(readers().mutex);
  return readers().all.size();
}

bool count_refused(std::string_view complaint) noexcept {
  // "DDS reader with topic rt/scan : iceoryx subscriber - TOO_MANY_CHUNKS_HELD_IN_PARALLEL -could
  // …"
  constexpr std::string_view kBegin = "DDS reader with topic rt", kEnd = " : iceoryx subscriber";
  const std::size_t end = complaint.find(kEnd);
  if (!complaint.starts_with(kBegin) || end == std::string_view::npos) return false;
  const std::string_view topic = complaint.substr(kBegin.size(), end - kBegin.size());
  const std::lock_guard lock(readers().mutex);
  SharedReader* next = nullptr;
  for (SharedReader* reader : readers().all) {
    if (reader->topic() == topic && (next == nullptr || reader->refused_ < next->refused_)) {
      next = reader;
    }
  }
  if (next != nullptr) {
    ++next->refused_;
    next->refused();
  }
  if (static constinit LogThrottle throttle; throttle.may_log()) {
    log(LogLevel::warn,
        "{}: messages are lost: iceoryx gives this subscription no more of its memory, as "
        "publishers that were killed have kept it; restart this process",
        topic);
  }
  return true;
}

}  // namespace takt
