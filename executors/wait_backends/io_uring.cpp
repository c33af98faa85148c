// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <utility>

#include <fmt/format.h>
#include <liburing.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/executors/wait_backends/reactor.hpp"

namespace takt {
namespace {

// The kernel completes requests only when the thread that owns the ring enters it.
constexpr unsigned kFlags = IORING_SETUP_SINGLE_ISSUER | IORING_SETUP_DEFER_TASKRUN;
constexpr unsigned kEntries = 64;

// Unlike a kernel thread id or a pthread_t, the number is never used again.
std::uint64_t this_thread_number() noexcept {
  static std::atomic<std::uint64_t> threads{0};
  thread_local const std::uint64_t number = ++threads;
  return number;
}

Error refusal(int error) {
  std::string because = errno_message(error);
  std::string what_to_do = "choose 'epoll'";
  if (error == EPERM) {
    int disabled = 0;
    std::ifstream("/proc/sys/kernel/io_uring_disabled") >> disabled;
    because += disabled != 0 ? fmt::format(" (kernel.io_uring_disabled is {})", disabled)
                             : " (a seccomp filter, as containers have)";
    if (disabled != 0) what_to_do += ", or set that to 0";
  } else if (error == ENOSYS) {
    because += " (the kernel is built without it)";
  } else if (error == EINVAL) {
    because += " (IORING_SETUP_DEFER_TASKRUN needs Linux 6.1)";
  } else if (error == ENOMEM) {
    what_to_do += ", or raise RLIMIT_MEMLOCK";
  }
  return {"io_uring: " + because, what_to_do};
}

/// One multishot poll for each descriptor: armed once, it reports each event. A ring
/// belongs to the thread that made it, so control threads only note what they want, and the thread
/// that waits hands it to the kernel. A wait may end without a completion.
class IoUringWaitBackend final : public Reactor {
 public:
  explicit IoUringWaitBackend(std::size_t workers) : Reactor(workers) {
    if (workers > 1) {
      throw Error(
          fmt::format("'io_uring' serves one waiting thread, this executor has {}", workers),
          "choose 'epoll', or an executor of one thread");
    }
    wake_.fd = event_fd_;
    wake_.events = POLLIN;
    io_uring probe{};
    if (const int error = -io_uring_queue_init(kEntries, &probe, kFlags)) throw refusal(error);
    io_uring_queue_exit(&probe);
  }
  ~IoUringWaitBackend() override {
    close_ring();
    if (completion_fd_ >= 0) close(completion_fd_);
  }

  void prepare() override {
    const std::uint64_t thread = this_thread_number();
    if (owner_ == thread) return;
    close_ring();
    if (const int error = -io_uring_queue_init(kEntries, &ring_, kFlags)) throw refusal(error);
    owner_ = thread;
    if (completion_fd_ >= 0) io_uring_register_eventfd(&ring_, completion_fd_);
    const std::lock_guard lock(mutex_);
    arm(wake_);
    for (Watched& watched : watched_) {
      watched.registered = -1;
      watched.is_leaving = false;
    }
    has_changes_.store(true);
    io_uring_submit(&ring_);
  }

  // An eventfd, as the ring's own descriptor does not become readable: nothing completes before the
  // ring's thread enters the kernel.
  int fd() noexcept override {
    if (completion_fd_ < 0 && owner_ != 0) {
      completion_fd_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
      io_uring_register_eventfd(&ring_, completion_fd_);
    }
    return completion_fd_;
  }

 private:
  // The lowest bit of user_data: the completion is that of a removal.
  static constexpr std::uint64_t kRemoval = 1;

  bool harvest(TimePoint deadline) noexcept override {
    if (has_changes_.load() && has_changes_.exchange(false)) hand_changes_over();
    if (deadline == kNow) {
      io_uring_submit_and_get_events(&ring_);
    } else {
      // The kernel takes absolute times since Linux 6.12 only.
      __kernel_timespec timeout{};
      if (deadline != kNever) {
        const Nanoseconds left = std::max(deadline - Clock::steady().now(), Nanoseconds::zero());
        const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
        timeout = {seconds.count(), (left - seconds).count()};
      }
      io_uring_cqe* first = nullptr;
      io_uring_submit_and_wait_timeout(&ring_, &first, 1, deadline == kNever ? nullptr : &timeout,
                                       nullptr);
    }
    bool has_announced = false;
    unsigned head = 0, count = 0;
    io_uring_cqe* completion = nullptr;
    io_uring_for_each_cqe(&ring_, head, completion) {
      ++count;
      if (completed(*completion)) has_announced = true;
    }
    io_uring_cq_advance(&ring_, count);
    return has_announced;
  }

  // True when a listener was notified.
  bool completed(const io_uring_cqe& completion) noexcept {
    auto& watched = *reinterpret_cast<Watched*>(completion.user_data & ~kRemoval);
    const bool is_removal = (completion.user_data & kRemoval) != 0;
    if ((completion.flags & IORING_CQE_F_MORE) == 0) {
      const std::lock_guard lock(mutex_);
      if (is_removal) {
        // Without a poll there is nothing to remove, else its own last completion follows.
        if (completion.res == -ENOENT) forget(watched);
        return false;
      }
      if (completion.res == -ECANCELED) forget(watched);
      // The kernel has ended the poll by itself: armed again, unless the descriptor is at fault.
      if (completion.res >= 0) forget(watched);
    }
    return completion.res != -ECANCELED && announce(watched);
  }

  void forget(Watched& watched) noexcept {
    watched.registered = -1;
    watched.is_leaving = false;
    has_changes_.store(true);
  }

  void hand_changes_over() noexcept {
    const std::lock_guard lock(mutex_);
    if (wake_.registered < 0) arm(wake_);
    for (Watched& watched : watched_) {
      const bool is_wanted = watched.listener.load() != nullptr;
      if (is_wanted && watched.registered < 0) {
        arm(watched);
      } else if (!is_wanted && watched.registered >= 0 && !watched.is_leaving) {
        watched.is_leaving = true;
        io_uring_sqe& request = next_request();
        io_uring_prep_poll_remove(&request, reinterpret_cast<std::uint64_t>(&watched));
        request.user_data = reinterpret_cast<std::uint64_t>(&watched) | kRemoval;
      }
    }
  }

  void arm(Watched& watched) noexcept {
    watched.registered = watched.fd;
    io_uring_sqe& request = next_request();
    io_uring_prep_poll_multishot(&request, watched.fd, static_cast<unsigned>(watched.events));
    request.user_data = reinterpret_cast<std::uint64_t>(&watched);
  }

  io_uring_sqe& next_request() noexcept {
    io_uring_sqe* request = io_uring_get_sqe(&ring_);
    while (request == nullptr) {  // the queue is full
      io_uring_submit(&ring_);
      request = io_uring_get_sqe(&ring_);
    }
    return *request;
  }

  void add(Watched&) override { note_changes(); }
  void remove(Watched&) noexcept override { note_changes(); }
  void note_changes() noexcept {
    has_changes_.store(true);
    kick();
  }

  void close_ring() noexcept {
    if (std::exchange(owner_, 0) != 0) io_uring_queue_exit(&ring_);
  }

  io_uring ring_{};
  std::uint64_t owner_ = 0;  // the thread whose ring it is; 0: there is none
  int completion_fd_ = -1;   // made when somebody asks for it
  Watched wake_;             // without a listener: it only ends the wait
  std::atomic<bool> has_changes_{false};
};

}  // namespace

// Without a cost, so never by `auto`: by our measurements it saves nothing
// (docs/explanation/architecture.md, sleeping and waking).
TAKT_REGISTER_WAIT_BACKEND("io_uring", "file descriptors too, for one thread; only by its name",
                           IoUringWaitBackend, .serves_file_descriptors = true, .max_workers = 1)

}  // namespace takt
