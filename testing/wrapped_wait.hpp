// A wait back end of a test: another one, with something between.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_WRAPPED_WAIT_HPP_
#define TAKT_TESTING_WRAPPED_WAIT_HPP_

#include <memory>
#include <string>
#include <utility>

#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// As epoll: other tests of this process run every back end that is registered.
class WrappedWait : public WaitBackend {
 public:
  explicit WrappedWait(std::size_t workers) : waits_(wait_backends().make("epoll", workers)) {}
  bool wait(std::size_t worker, TimePoint deadline) noexcept override {
    return waits_->wait(worker, deadline);
  }
  void post() noexcept override { waits_->post(); }
  void enter(std::size_t worker, const ThreadAttributes& attributes) noexcept override {
    waits_->enter(worker, attributes);
  }
  void leave(std::size_t worker) noexcept override { waits_->leave(worker); }
  bool serves_file_descriptors() const noexcept override {
    return waits_->serves_file_descriptors();
  }
  void watch(const Watch& watch) override { waits_->watch(watch); }
  void unwatch(const ArrivalListener* listener) noexcept override { waits_->unwatch(listener); }
  void prepare() override { waits_->prepare(); }
  bool look() noexcept override { return waits_->look(); }
  int fd() noexcept override { return waits_->fd(); }

 private:
  const std::unique_ptr<WaitBackend> waits_;
};

/// Registers it, once.
template <class Wrapped>
std::string wrapped_wait(const std::string& name) {
  static const bool is_added = [&] {
    const auto make = [](std::size_t workers) { return std::make_unique<Wrapped>(workers); };
    wait_backends().add(name, {"epoll, for a test", make});
    return true;
  }();
  return is_added ? name : std::string();
}

}  // namespace takt

#endif  // TAKT_TESTING_WRAPPED_WAIT_HPP_
