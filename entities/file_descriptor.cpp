// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/file_descriptor.hpp"

#include <cerrno>
#include <memory>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"

namespace takt {
namespace {

using Events = FileDescriptorEvents;
constexpr short kEnd = POLLHUP | POLLRDHUP | POLLERR;

short checked(const std::string& name, Events events) {
  if (events == Events::none || contains(events, Events::hang_up | Events::error)) {
    throw Error("file descriptor '" + name + "' waits for neither reading nor writing alone",
                "give `readable`, `writable` or both; hang-up and error are always reported");
  }
  return static_cast<short>((contains(events, Events::readable) ? POLLIN | POLLRDHUP : 0) |
                            (contains(events, Events::writable) ? POLLOUT : 0));
}

// Asks the kernel: the driver of a file decides whether it can be waited for.
int checked(const std::string& name, int fd) {
  int error = fcntl(fd, F_GETFD) < 0 ? errno : 0;
  if (error == 0) {
    const int scratch = epoll_create1(EPOLL_CLOEXEC);
    epoll_event event{};
    if (epoll_ctl(scratch, EPOLL_CTL_ADD, fd, &event) != 0) error = errno;
    close(scratch);
  }
  if (error == EPERM) {
    throw Error(fmt::format("'{}': nothing can wait for the file behind descriptor {}", name, fd),
                "it is always ready, as regular files are; read it directly");
  }
  if (error != 0) {
    throw Error(fmt::format("'{}': descriptor {}: {}", name, fd, errno_message(error)),
                "give one that is open");
  }
  return fd;
}

}  // namespace

FileDescriptor::FileDescriptor(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
                               int fd, FileDescriptorEvents events,
                               std::function<void(FileDescriptorEvents)> callback)
    : Entity(EntityKind::waitable, std::move(name), std::move(group)),
      clock_(clock),
      fd_(checked(this->name(), fd)),
      poll_events_(checked(this->name(), events)),
      is_reentrant_(this->group()->type() == CallbackGroupType::Reentrant),
      callback_(std::move(callback)) {
}

// The events that the callback would get now. At the end of a stream the kernel reports the
// descriptor readable (sockets) or writable (pipes) for ever: so the end counts only once, and only
// when nothing is left to read.
FileDescriptorEvents FileDescriptor::ready_events() const noexcept {
  if (is_closed_.load(std::memory_order_relaxed)) return Events::none;
  pollfd request{fd_, poll_events_, 0};
  if (poll(&request, 1, 0) < 0) return Events::none;
  short ready = request.revents;
  if ((ready & POLLNVAL) != 0) {
    if (!is_closed_.exchange(true)) {
      log(LogLevel::error,
          "descriptor {} of '{}' was closed before the entity was dropped; it is not served any "
          "more",
          fd_, name());
    }
    return Events::none;
  }
  if ((ready & kEnd) != 0) {
    ready &= ~POLLOUT;
    int bytes = 0;
    if ((ready & POLLIN) != 0 && ioctl(fd_, FIONREAD, &bytes) == 0 && bytes == 0) ready &= ~POLLIN;
  }
  if ((ready & (POLLIN | POLLOUT)) != 0) {
    return ((ready & POLLIN) != 0 ? Events::readable : Events::none) |
           ((ready & POLLOUT) != 0 ? Events::writable : Events::none);
  }
  if ((ready & kEnd) == 0) {
    end_is_reported_.store(false);
    return Events::none;
  }
  if (end_is_reported_.load()) return Events::none;
  return ((ready & (POLLHUP | POLLRDHUP)) != 0 ? Events::hang_up : Events::none) |
         ((ready & POLLERR) != 0 ? Events::error : Events::none);
}

void FileDescriptor::announce(const Arrival& arrival) noexcept {
  if (ready_count() == 0) return;
  TimePoint none{};
  ready_time_.compare_exchange_strong(none, arrival.ready_time);
  Entity::announce(arrival);
}

bool FileDescriptor::take(Slot& slot) noexcept {
  // The thread that executes the callback now checks the descriptor again afterwards.
  if (is_reentrant_ && is_executing_.exchange(true)) return false;
  const Events events = ready_events();
  if (events == Events::none) {
    if (is_reentrant_) is_executing_.store(false);
    ready_time_.store({});
    return false;
  }
  end_is_reported_.store(contains(events, Events::hang_up | Events::error));
  slot.events = static_cast<std::uint8_t>(events);
  // Data that the callback leaves unread counts as ready from now on.
  slot.ready_time = ready_time_.exchange(clock_.now());
  return true;
}

void FileDescriptor::execute(Slot& slot) {
  const auto at_end = [](FileDescriptor* self) { self->look_again(); };
  const std::unique_ptr<FileDescriptor, decltype(at_end)> guard(this, at_end);
  if (callback_) callback_(static_cast<Events>(slot.events));
}

void FileDescriptor::discard(Slot&) noexcept {
  look_again();
}

// The wait back end reports only new events: it does not know what the callback has left unread.
void FileDescriptor::look_again() noexcept {
  if (is_reentrant_) is_executing_.store(false);
  if (!is_attached()) return;  // the callback has dropped the entity, and may have closed its file
  if (ready_count() == 0) return ready_time_.store({});
  const ReadSection section;
  Entity::announce({next_sequence(), clock_.now()});
}

}  // namespace takt
