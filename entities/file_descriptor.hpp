// A callback for a device, pipe or socket.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_FILE_DESCRIPTOR_HPP_
#define TAKT_ENTITIES_FILE_DESCRIPTOR_HPP_

#include <atomic>
#include <cstdint>
#include <functional>

#include "takt/base/clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {

/// Events to wait for (`readable`, `writable`, or both), and the argument of a callback.
enum class FileDescriptorEvents : std::uint8_t {
  none = 0,
  readable = 1,
  writable = 2,
  hang_up = 4,  // the other end has gone, and all that it has sent is read
  error = 8,    // read, write or getsockopt(SO_ERROR) says which
};

constexpr FileDescriptorEvents operator|(FileDescriptorEvents a, FileDescriptorEvents b) noexcept {
  return static_cast<FileDescriptorEvents>(static_cast<std::uint8_t>(a) |
                                           static_cast<std::uint8_t>(b));
}
constexpr bool contains(FileDescriptorEvents events, FileDescriptorEvents event) noexcept {
  return (static_cast<std::uint8_t>(events) & static_cast<std::uint8_t>(event)) != 0;
}

/// Runs its callback for as long as the file descriptor is readable or writable (level-triggered):
/// if one call leaves something unread, the callback is called again. `hang_up` and `error` are
/// reported once, without the other two, when nothing is left to read; again only after the
/// descriptor was usable in between. A descriptor that was closed is logged once, and never served
/// again. Its callback runs at one place at a time, in a reentrant group too.
///
/// The descriptor belongs to the user. Keep it open until the entity is dropped. It should not
/// block: another process may read what was there.
///
/// Thread safety: as Entity.
/// Real-time: ready_count and take make one system call, poll(2) with a zero time-out, and execute
/// one after the callback (at a hang-up also ioctl(FIONREAD)); nothing blocks or allocates, but the
/// log line for a closed descriptor.
class FileDescriptor final : public Entity, private ArrivalListener {
 public:
  /// Throws Error when `events` asks for something else than reading and writing, and when the
  /// kernel cannot wait for the file (regular files, /dev/null) or it is not open.
  FileDescriptor(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock, int fd,
                 FileDescriptorEvents events, std::function<void(FileDescriptorEvents)> callback);

  int fd() const noexcept { return fd_; }

  std::size_t ready_count() const noexcept override {
    return ready_events() == FileDescriptorEvents::none ? 0 : 1;
  }
  Watch watch() noexcept override { return {fd_, poll_events_, this}; }
  bool take(Slot& slot) noexcept override;
  void execute(Slot& slot) override;
  void discard(Slot& slot) noexcept override;

 private:
  /// From the wait back end: edges, among them some for what was read long ago.
  void announce(const Arrival& arrival) noexcept override;
  FileDescriptorEvents ready_events() const noexcept;
  void look_again() noexcept;

  Clock& clock_;
  const int fd_;
  const short poll_events_;
  const bool is_reentrant_;
  const std::function<void(FileDescriptorEvents)> callback_;
  std::atomic<bool> is_executing_{false};             // kept in reentrant groups only
  mutable std::atomic<bool> end_is_reported_{false};  // hang-up or error
  mutable std::atomic<bool> is_closed_{false};        // by the user, while we watch it
  std::atomic<TimePoint> ready_time_{};               // of what is not taken; {} unknown
};

}  // namespace takt

#endif  // TAKT_ENTITIES_FILE_DESCRIPTOR_HPP_
