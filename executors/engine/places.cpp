// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/places.hpp"

#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::detail {

Places::Places(const ExecutorOptions& options, std::size_t workers, bool are_told_apart)
    : options_(options), workers_(workers), places_(are_told_apart ? workers : 1) {
}

void Places::choose(bool has_file_descriptors) {
  for (Place& place : places_) {
    place.backend =
        make_wait_backend(options_.wait, *options_.clock, workers_, has_file_descriptors);
  }
}

void Places::prepare() {
  for (Place& place : places_) place.backend->prepare();
}

void Places::forget() noexcept {
  for (Place& place : places_) place.backend.reset();
  watched_.store(0);
}

void Places::watch(CallbackRecord& record) {
  const Watch watch = record.entity->watch();
  if (watch.fd < 0 || !are_chosen()) return;
  if (!places_.front().backend->serves_file_descriptors()) {
    const bool is_auto = options_.wait == kAutoWait;
    throw Error(
        fmt::format("executor '{}' waits by '{}', which cannot serve file descriptor '{}'",
                    options_.name, is_auto ? "futex" : options_.wait, record.entity->name()),
        is_auto ? "add the first one before the first spin, or choose `wait: epoll`"
                : "choose `wait: epoll`, or leave it out");
  }
  // In every place: the workers that may take the callback can change, and any of them may be busy.
  for (Place& place : places_) place.backend->watch(watch);
  record.is_watched = true;
  watched_.fetch_add(1);
}

void Places::unwatch(CallbackRecord& record) noexcept {
  if (!std::exchange(record.is_watched, false)) return;
  for (Place& place : places_) place.backend->unwatch(record.entity->watch().listener);
  watched_.fetch_sub(1);
}

bool Places::look() noexcept {
  bool has_found = false;
  for (Place& place : places_) has_found |= place.backend->look();
  return has_found;
}

bool Places::wake_one_of(WorkerSet workers) noexcept {
  if (places_.size() == 1) return places_.front().wake();
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if ((workers >> i & 1) != 0 && places_[i].wake()) return true;
  }
  return false;
}

void Places::wake_all() noexcept {
  for (Place& place : places_) place.sleepers.wake_all([&] { place.backend->post(); });
}

}  // namespace takt::detail
