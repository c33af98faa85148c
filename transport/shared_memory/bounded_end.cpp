// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <system_error>
#include <thread>

#include <dds/dds.h>
#include <unistd.h>

#include "takt/base/logger.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

constexpr auto kEndLimit = 3s;

std::atomic<bool> deletes_no_more{false};

/// False: no thread can be started. Does not throw, as the process is ending.
template <class Work>
bool start_apart(Work work) noexcept {
  try {
    std::thread(std::move(work)).detach();
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

// glibc calls exit handlers and static destructors in the reverse order of registration: so this
// runs before iceoryx destroys what the deletion of an entity needs. Nodes in static storage may be
// destroyed later: their endpoints are not deleted, and other processes notice when the lease ends.
void end_in_time(int status, void*) {
  deletes_no_more.store(true);
  std::fflush(nullptr);  // output that iceoryx would keep from being written
  start_apart([status] {
    std::this_thread::sleep_for(kEndLimit);
    constexpr char kText[] =
        "[error] RouDi does not answer: this process ends without a goodbye to it\n";
    [[maybe_unused]] const ssize_t ignored = write(STDERR_FILENO, kText, sizeof kText - 1);
    _exit(status);
  });
}

}  // namespace

void delete_within_bound(std::int32_t entity) {
  if (deletes_no_more.load()) return;
  std::promise<void> deleted;
  std::future<void> is_deleted = deleted.get_future();
  if (!start_apart([entity, deleted = std::move(deleted)]() mutable {
        dds_delete(entity);
        deleted.set_value();
      })) {
    dds_delete(entity);
    return;
  }
  if (is_deleted.wait_for(kEndLimit) == std::future_status::ready) return;
  if (deletes_no_more.exchange(true)) return;
  log(LogLevel::error,
      "shared memory hangs on a lock that a killed process held: what uses it here is not taken "
      "down any more; restart this process");
}

void bound_exit() {
  [[maybe_unused]] static const int once = on_exit(end_in_time, nullptr);
}

}  // namespace takt
