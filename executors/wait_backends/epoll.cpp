// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <span>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "takt/executors/wait_backends/reactor.hpp"

namespace takt {
namespace {

/// All descriptors are watched edge-triggered: the kernel reports what is new, to one worker, and
/// nothing has to be armed again.
class EpollWaitBackend final : public Reactor {
 public:
  explicit EpollWaitBackend(std::size_t workers)
      : Reactor(workers), epoll_fd_(epoll_create1(EPOLL_CLOEXEC)) {
    epoll_event event{EPOLLIN | EPOLLET, {nullptr}};
    if (epoll_fd_ < 0 || epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, event_fd_, &event) != 0) {
      const int error = errno;
      if (epoll_fd_ >= 0) close(epoll_fd_);
      throw Error("epoll: " + errno_message(error), "choose `wait: futex`");
    }
  }
  ~EpollWaitBackend() override {
    for (Watched& watched : watched_) remove(watched);
    close(epoll_fd_);
  }

  int fd() noexcept override { return epoll_fd_; }

 private:
  bool harvest(TimePoint deadline) noexcept override {
    timespec timeout{};
    if (deadline != kNow && deadline != kNever) {
      const Nanoseconds left = std::max(deadline - Clock::steady().now(), Nanoseconds::zero());
      const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
      timeout = {seconds.count(), (left - seconds).count()};
    }
    std::array<epoll_event, 16> events;  // what does not fit comes next time
    const int count = gather(events, deadline == kNever ? nullptr : &timeout);
    bool has_announced = false;
    for (int i = 0; i < count; ++i) {
      const auto* watched = static_cast<const Watched*>(events[i].data.ptr);
      if (watched != nullptr && announce(*watched)) has_announced = true;
    }
    return has_announced;
  }

  // Kernels before 5.11 have no epoll_pwait2, and some sandboxes refuse it: then it takes two
  // calls.
  int gather(std::span<epoll_event> events, const timespec* timeout) noexcept {
    const int most = static_cast<int>(events.size());
    if (!is_refused_.load(std::memory_order_relaxed)) {
      const int count = epoll_pwait2(epoll_fd_, events.data(), most, timeout, nullptr);
      if (count >= 0 || (errno != ENOSYS && errno != EPERM)) return count;
      is_refused_.store(true, std::memory_order_relaxed);
    }
    pollfd ready{epoll_fd_, POLLIN, 0};
    ppoll(&ready, 1, timeout, nullptr);
    return epoll_wait(epoll_fd_, events.data(), most, 0);
  }

  void add(Watched& watched) override {
    const bool is_added = control(watched, watched.fd);
    if (is_added) {
      // If epoll has watched this number before, the user has closed that file meanwhile. Its
      // entity must not end the watch of the new file.
      for (Watched& other : watched_) {
        if (&other != &watched && other.registered == watched.fd) other.registered = -1;
      }
      watched.registered = watched.fd;
      return;
    }
    int error = errno;
    if (error == EEXIST) {  // epoll takes a descriptor once: two entities need two
      watched.registered = fcntl(watched.fd, F_DUPFD_CLOEXEC, 0);
      if (watched.registered >= 0 && control(watched, watched.registered)) return;
      error = errno;
      if (watched.registered >= 0) close(std::exchange(watched.registered, -1));
    }
    throw Error(
        fmt::format("descriptor {} cannot be watched: {}", watched.fd, errno_message(error)));
  }

  bool control(Watched& watched, int fd) noexcept {
    epoll_event event{static_cast<std::uint32_t>(watched.events) | EPOLLET, {&watched}};
    return epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, fd, &event) == 0;
  }

  void remove(Watched& watched) noexcept override {
    if (watched.registered < 0) return;
    epoll_event unused{};
    epoll_ctl(epoll_fd_, EPOLL_CTL_DEL, watched.registered, &unused);
    if (watched.registered != watched.fd) close(watched.registered);
    watched.registered = -1;
  }

  const int epoll_fd_;
  std::atomic<bool> is_refused_{false};  // epoll_pwait2
};

}  // namespace

TAKT_REGISTER_WAIT_BACKEND("epoll", "file descriptors too, for any number of threads",
                           EpollWaitBackend, .serves_file_descriptors = true, .cost = 2)

}  // namespace takt
