// The common part of the wait back ends that watch file descriptors.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_BACKENDS_REACTOR_HPP_
#define TAKT_EXECUTORS_WAIT_BACKENDS_REACTOR_HPP_

#include <atomic>
#include <cstdint>
#include <deque>

#include "takt/base/pi_mutex.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// Posts are counted in `posts_`. An event descriptor, which is watched like the others and never
/// read, brings them to workers that sleep:
/// 1. A thread that posts counts first, and then kicks: writes to the event descriptor.
/// 2. A worker that comes back from the kernel, for whatever reason, looks for a post.
/// 3. Two kicks can reach one worker as one, and a worker that only looks takes a kick from the
///    sleepers. So a worker that takes a post and sees another kicks again, and so does one that
///    looks and sees a post.
/// As long as there are posts, a kick is on its way, or a worker is awake that will look.
///
/// Thread safety and real-time: as WaitBackend.
class Reactor : public WaitBackend {
 public:
  ~Reactor() override;
  bool wait(std::size_t worker, TimePoint deadline) noexcept final;
  void post() noexcept final;
  bool serves_file_descriptors() const noexcept final { return true; }
  void watch(const Watch& watch) final;
  void unwatch(const ArrivalListener* listener) noexcept final;
  bool look() noexcept final;

 protected:
  /// One descriptor. Its memory is type-stable, so the kernel may hand us its address long after it
  /// was unwatched; when it was used again meanwhile, the notification is spurious.
  struct Watched {
    int fd = -1;
    short events = 0;
    std::atomic<ArrivalListener*> listener{nullptr};
    int registered = -1;      // the descriptor that the kernel watches; -1: none
    bool is_leaving = false;  // io_uring: its removal was requested
  };
  static constexpr TimePoint kNow{};

  explicit Reactor(std::size_t workers);

  /// Waits for events until the deadline (kNow: not at all), and announces them. True when there
  /// were some; false may come at any time.
  virtual bool harvest(TimePoint deadline) noexcept = 0;
  /// Control threads, with mutex_ held. Throws Error.
  virtual void add(Watched& watched) = 0;
  virtual void remove(Watched& watched) noexcept = 0;

  /// Notifies the listener, if there is still one.
  static bool announce(const Watched& watched) noexcept;
  /// Brings a worker back from the kernel.
  void kick() noexcept;

  PiMutex mutex_;                // guards watched_, but its listeners; never held in the kernel
  std::deque<Watched> watched_;  // only grows
  const int event_fd_;

 private:
  bool take_post() noexcept;

  const bool has_several_workers_;
  alignas(64) std::atomic<std::uint32_t> posts_{0};
  // The back end in whose `wait` the calling thread announces: a post from there needs no kick.
  static thread_local constinit const Reactor* announcing_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_BACKENDS_REACTOR_HPP_
