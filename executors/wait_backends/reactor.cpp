// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/reactor.hpp"

#include <algorithm>
#include <cerrno>
#include <mutex>

#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"

namespace takt {

thread_local constinit const Reactor* Reactor::announcing_ = nullptr;

Reactor::Reactor(std::size_t workers)
    : event_fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), has_several_workers_(workers > 1) {
  if (event_fd_ < 0) throw Error("eventfd: " + errno_message(errno), "choose `wait: futex`");
}

Reactor::~Reactor() {
  close(event_fd_);
}

bool Reactor::wait(std::size_t, TimePoint deadline) noexcept {
  for (;;) {
    if (take_post()) return true;
    announcing_ = this;
    const bool has_announced = harvest(deadline);
    announcing_ = nullptr;
    if (take_post()) return true;
    if (has_announced || (deadline != kNever && Clock::steady().now() >= deadline)) return false;
  }
}

bool Reactor::look() noexcept {
  const bool has_announced = harvest(kNow);
  if (has_several_workers_ && posts_.load() != 0) kick();
  return has_announced;
}

void Reactor::post() noexcept {
  posts_.fetch_add(1);
  if (announcing_ == this) {
    announcing_ = nullptr;  // we take one post ourselves; the next needs another worker
  } else {
    kick();
  }
}

bool Reactor::take_post() noexcept {
  std::uint32_t posts = posts_.load();
  while (posts != 0) {
    if (!posts_.compare_exchange_weak(posts, posts - 1)) continue;
    if (posts > 1 && has_several_workers_) kick();
    return true;
  }
  return false;
}

void Reactor::kick() noexcept {
  const std::uint64_t one = 1;
  // It fails only when it was written 2^64 times.
  [[maybe_unused]] const ssize_t written = write(event_fd_, &one, sizeof one);
}

void Reactor::watch(const Watch& watch) {
  const std::lock_guard lock(mutex_);
  auto place = std::find_if(watched_.begin(), watched_.end(), [&](const Watched& watched) {
    return watched.listener.load() == watch.listener;
  });
  if (place != watched_.end()) return;
  place = std::find_if(watched_.begin(), watched_.end(), [](const Watched& watched) {
    return watched.listener.load() == nullptr && watched.registered < 0;
  });
  Watched& watched = place != watched_.end() ? *place : watched_.emplace_back();
  watched.fd = watch.fd;
  watched.events = watch.events;
  watched.listener.store(watch.listener);
  try {
    add(watched);
  } catch (...) {
    watched.listener.store(nullptr);
    throw;
  }
}

void Reactor::unwatch(const ArrivalListener* listener) noexcept {
  const std::lock_guard lock(mutex_);
  const auto place = std::find_if(watched_.begin(), watched_.end(), [&](const Watched& watched) {
    return watched.listener.load() == listener;
  });
  if (place == watched_.end()) return;
  place->listener.store(nullptr);
  remove(*place);
}

bool Reactor::announce(const Watched& watched) noexcept {
  const ReadSection section;
  ArrivalListener* listener = watched.listener.load();
  if (listener == nullptr) return false;
  listener->announce({next_sequence(), Clock::steady().now()});
  return true;
}

}  // namespace takt
