// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ring_file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <new>
#include <optional>
#include <thread>
#include <utility>

#include <boost/lockfree/spsc_queue.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <liburing.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {

/// Writes several buffers at the same time, and reports the result of each write.
class RingFile::Writes {
 public:
  struct Completion {
    std::size_t index = 0;
    int result = 0;  // bytes written, or a negative errno
  };
  virtual ~Writes() = default;
  virtual void submit(std::size_t index, std::span<const std::byte> bytes,
                      std::uint64_t offset) noexcept = 0;
  /// The next completed write, if any; with `waits`, waits for one.
  virtual std::optional<Completion> next(bool waits) noexcept = 0;
};

class RingFile::RingWrites final : public Writes {
 public:
  /// Throws Error if the kernel refuses the ring or the buffers.
  RingWrites(int fd, const std::vector<iovec>& buffers)
      : fd_(fd), registered_(buffers.size()), ring_(buffers.size() + kMostOwn) {
    const auto count = static_cast<unsigned>(buffers.size());
    if (const int result = io_uring_register_buffers(&ring_.ring, buffers.data(), count);
        result < 0) {
      throw Error("io_uring refused the buffers: " + errno_message(-result),
                  "raise RLIMIT_MEMLOCK");
    }
  }
  void submit(std::size_t index, std::span<const std::byte> bytes,
              std::uint64_t offset) noexcept override {
    io_uring_sqe* entry = io_uring_get_sqe(&ring_.ring);  // there is one for each buffer
    const auto size = static_cast<unsigned>(bytes.size());
    if (index < registered_) {
      io_uring_prep_write_fixed(entry, fd_, bytes.data(), size, offset, static_cast<int>(index));
    } else {
      io_uring_prep_write(entry, fd_, bytes.data(), size, offset);
    }
    io_uring_sqe_set_data64(entry, index);
    if (const int result = io_uring_submit(&ring_.ring); result < 0) refused_ = {index, result};
  }
  std::optional<Completion> next(bool waits) noexcept override {
    if (refused_) return std::exchange(refused_, std::nullopt);
    io_uring_cqe* entry = nullptr;
    int result = -EINTR;
    while (result == -EINTR) {
      result =
          waits ? io_uring_wait_cqe(&ring_.ring, &entry) : io_uring_peek_cqe(&ring_.ring, &entry);
    }
    if (result < 0) return std::nullopt;
    const Completion completion{static_cast<std::size_t>(io_uring_cqe_get_data64(entry)),
                                entry->res};
    io_uring_cqe_seen(&ring_.ring, entry);
    return completion;
  }

 private:
  /// Releases the ring only if it was created: otherwise liburing would close descriptor 0.
  struct Ring {
    explicit Ring(std::size_t entries) {
      const int result = io_uring_queue_init(static_cast<unsigned>(entries), &ring, 0);
      if (result < 0) throw Error("io_uring: " + errno_message(-result));
    }
    ~Ring() { io_uring_queue_exit(&ring); }
    Ring(const Ring&) = delete;
    Ring& operator=(const Ring&) = delete;
    io_uring ring{};
  };

  const int fd_;
  const std::size_t registered_;
  Ring ring_;
  std::optional<Completion> refused_;
};

/// The calling thread and the writing one hand writes to each other without a lock: each is the
/// only producer of one queue and the only consumer of the other, and no more writes than buffers
/// are on their way, so that neither queue is ever full.
class RingFile::ThreadWrites final : public Writes {
 public:
  ThreadWrites(int fd, std::size_t buffers) : fd_(fd), asked_(buffers), ended_(buffers) {
    thread_ = std::thread([this] { write_until_stopped(); });
  }
  ~ThreadWrites() override {
    is_over_.store(true);
    announce(asked_count_);
    thread_.join();
  }
  void submit(std::size_t index, std::span<const std::byte> bytes,
              std::uint64_t offset) noexcept override {
    asked_.push({index, bytes, offset});
    announce(asked_count_);
  }
  std::optional<Completion> next(bool waits) noexcept override {
    for (;;) {
      const std::uint32_t seen = ended_count_.load();
      if (Completion completion; ended_.pop(completion)) return completion;
      if (!waits) return std::nullopt;
      ended_count_.wait(seen);
    }
  }

 private:
  struct Write {
    std::size_t index;
    std::span<const std::byte> bytes;
    std::uint64_t offset;
  };
  static void announce(std::atomic<std::uint32_t>& count) noexcept {
    count.fetch_add(1);
    count.notify_one();
  }
  void write_until_stopped() {
    apply({.name = "recording"}, Realtime::prefer);  // do not inherit the creator's attributes
    for (;;) {
      const std::uint32_t seen = asked_count_.load();
      const bool is_over = is_over_.load();
      for (Write write; asked_.pop(write);) {
        const ssize_t written =
            pwrite(fd_, write.bytes.data(), write.bytes.size(), static_cast<off_t>(write.offset));
        ended_.push({write.index, written < 0 ? -errno : static_cast<int>(written)});
        announce(ended_count_);
      }
      if (is_over) return;
      asked_count_.wait(seen);
    }
  }

  const int fd_;
  boost::lockfree::spsc_queue<Write> asked_;
  boost::lockfree::spsc_queue<Completion> ended_;
  std::atomic<std::uint32_t> asked_count_{0}, ended_count_{0};  // what the two threads sleep on
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

namespace {

/// It is written at positions.
const FilePlace& no_fifo(const FilePlace& place) {
  struct stat about {};
  if (!place.is_beneath() && stat(place.path().c_str(), &about) == 0 && S_ISFIFO(about.st_mode)) {
    throw Error("this is a FIFO", "choose a regular file", place.path());
  }
  return place;
}

}  // namespace

RingFile::RingFile(const FilePlace& place, std::size_t buffer_bytes, std::size_t buffers)
    : buffer_bytes_(buffer_bytes), file_(no_fifo(place)), memory_bytes_(buffer_bytes * buffers) {
  if (buffers > kMostBytes / buffer_bytes) {
    throw Error(fmt::format("{} buffers of {} bytes are more than {} MB", buffers, buffer_bytes,
                            kMostBytes / 1'000'000),
                "use fewer or smaller ones", place.path());
  }
  buffers_.resize(buffers + kMostOwn);
  void* memory = mmap(nullptr, memory_bytes_, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) {
    const int error = errno;
    throw Error("no memory for buffers: " + errno_message(error),
                fmt::format("use fewer or smaller ones than {} MB", memory_bytes_ / 1'000'000 + 1),
                place.path());
  }
  memory_ = static_cast<std::byte*>(memory);
  for (std::size_t i = 0; i < buffers; ++i) {
    buffers_[i].memory = {memory_ + i * buffer_bytes_, buffer_bytes_};
  }
  writes_ = make_writes();
}

std::unique_ptr<RingFile::Writes> RingFile::make_writes() {
  std::vector<iovec> buffers;
  for (const Buffer& buffer : buffers_) {
    if (!buffer.memory.empty()) buffers.push_back({buffer.memory.data(), buffer.memory.size()});
  }
  try {
    return std::make_unique<RingWrites>(file_.fd(), buffers);
  } catch (const Error& error) {
    why_no_ring_ = error.what();
    return std::make_unique<ThreadWrites>(file_.fd(), buffers_.size());
  }
}

RingFile::~RingFile() {
  finish();
  writes_.reset();
  munmap(memory_, memory_bytes_);
  file_.try_complete();  // what a failure has left is worth keeping
}

std::span<std::byte> RingFile::buffer() noexcept {
  if (current_ == SIZE_MAX) {
    reap();
    const auto end = buffers_.end() - kMostOwn;
    const auto free =
        std::find_if(buffers_.begin(), end, [](const Buffer& buffer) { return !buffer.is_away; });
    if (free == end) return {};
    current_ = static_cast<std::size_t>(free - buffers_.begin());
  }
  return buffers_[current_].memory;
}

bool RingFile::make_own(std::size_t bytes) noexcept {
  reap();
  const auto free = std::find_if(buffers_.end() - kMostOwn, buffers_.end(),
                                 [](const Buffer& buffer) { return !buffer.is_away; });
  if (free == buffers_.end() || bytes > kMostBytes - memory_bytes_ - own_bytes_) return false;
  free->own.reset(new (std::nothrow) std::byte[bytes]);
  if (free->own == nullptr) return false;
  free->memory = {free->own.get(), bytes};
  own_bytes_ += bytes;
  current_ = static_cast<std::size_t>(free - buffers_.begin());
  return true;
}

void RingFile::free_own(Buffer& buffer) noexcept {
  if (buffer.own == nullptr) return;
  own_bytes_ -= buffer.memory.size();
  buffer.memory = {};
  buffer.own.reset();
}

void RingFile::write(std::size_t bytes) noexcept {
  const std::size_t index = std::exchange(current_, SIZE_MAX);
  Buffer& buffer = buffers_[index];
  if (error_ != 0) return free_own(buffer);
  buffer.begin = offset_;
  buffer.bytes = bytes;
  buffer.done = 0;
  buffer.is_away = true;
  offset_ += bytes;
  ++away_;
  submit(index);
}

// The part of the buffer that is not written yet.
void RingFile::submit(std::size_t index) noexcept {
  const Buffer& buffer = buffers_[index];
  writes_->submit(index, buffer.memory.first(buffer.bytes).subspan(buffer.done),
                  buffer.begin + buffer.done);
}

void RingFile::reap() noexcept {
  while (away_ != 0) {
    const auto completion = writes_->next(false);
    if (!completion) return;
    completed(completion->index, completion->result);
  }
}

// Writes complete in any order: the file is complete up to the first one that is in progress or
// failed.
void RingFile::completed(std::size_t index, int result) noexcept {
  Buffer& buffer = buffers_[index];
  if (result > 0) buffer.done += static_cast<std::size_t>(result);
  // A full disk writes a part first, and reports the error at the next attempt.
  if (result == -EINTR || (result > 0 && buffer.done < buffer.bytes)) return submit(index);
  --away_;
  buffer.is_away = false;
  free_own(buffer);
  if (buffer.done < buffer.bytes) {
    if (error_ == 0) {
      error_ = result < 0 ? -result : EIO;
      written_ = buffer.begin;
    }
    if (first_error_ == 0) first_error_ = error_;
    written_ = std::min(written_, buffer.begin);
    return;
  }
  if (error_ != 0) return;
  written_ = offset_;
  for (const Buffer& other : buffers_) {
    if (other.is_away) written_ = std::min(written_, other.begin);
  }
}

bool RingFile::finish() noexcept {
  while (away_ != 0) {
    if (const auto completion = writes_->next(true)) {
      completed(completion->index, completion->result);
    } else {  // the ring itself failed
      error_ = EIO;
      if (first_error_ == 0) first_error_ = error_;
      break;
    }
  }
  return error_ == 0;
}

bool RingFile::complete() noexcept {
  const bool is_whole = finish();
  writes_.reset();
  const int error = file_.try_complete();
  if (first_error_ == 0) first_error_ = error;
  return is_whole && error == 0;
}

void RingFile::cut(std::uint64_t end) noexcept {
  finish();
  if (ftruncate(file_.fd(), static_cast<off_t>(end)) != 0) return;
  offset_ = written_ = end;
  error_ = 0;
}

}  // namespace takt
