// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ring_file.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <liburing.h>
#include <sys/mman.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {

/// Only one that was made is taken down: liburing would take the zeros of another for descriptors.
struct RingFile::Ring {
  explicit Ring(std::size_t entries) {
    const int result = io_uring_queue_init(static_cast<unsigned>(entries), &ring, 0);
    if (result < 0) {
      throw Error("io_uring: " + errno_message(-result), "see: takt list wait_backends");
    }
  }
  ~Ring() { io_uring_queue_exit(&ring); }
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;

  io_uring ring{};
};

RingFile::RingFile(const std::string& path, std::size_t buffer_bytes, std::size_t buffers)
    : buffer_bytes_(buffer_bytes),
      ring_(std::make_unique<Ring>(buffers)),
      memory_bytes_(buffer_bytes * buffers),
      buffers_(buffers) {
  fd_ = open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw Error("the file cannot be written: " + errno_message(errno), "choose a place that can be",
                path);
  }
  const auto fail = [this](const std::string& what, const std::string& what_to_do) {
    close(fd_);
    if (memory_ != nullptr) munmap(memory_, memory_bytes_);
    throw Error(what, what_to_do);
  };
  void* memory = mmap(nullptr, memory_bytes_, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) fail("no memory for buffers: " + errno_message(errno), "");
  memory_ = static_cast<std::byte*>(memory);
  std::vector<iovec> registered;
  for (std::size_t i = 0; i < buffers; ++i) {
    registered.push_back({memory_ + i * buffer_bytes, buffer_bytes});
  }
  if (const int result = io_uring_register_buffers(&ring_->ring, registered.data(),
                                                   static_cast<unsigned>(buffers));
      result < 0) {
    fail("io_uring takes no buffers: " + errno_message(-result),
         fmt::format("raise RLIMIT_MEMLOCK above {} MB, or give fewer",
                     memory_bytes_ / 1'000'000 + 1));
  }
}

RingFile::~RingFile() {
  finish();
  ring_.reset();
  munmap(memory_, memory_bytes_);
  close(fd_);
}

std::span<std::byte> RingFile::buffer() noexcept {
  if (current_ == SIZE_MAX) {
    reap();
    const auto free = std::find_if(buffers_.begin(), buffers_.end(),
                                   [](const Buffer& buffer) { return !buffer.is_away; });
    if (free == buffers_.end()) return {};
    current_ = static_cast<std::size_t>(free - buffers_.begin());
  }
  return {memory_ + current_ * buffer_bytes_, buffer_bytes_};
}

void RingFile::write(std::size_t bytes) noexcept {
  const std::size_t index = std::exchange(current_, SIZE_MAX);
  if (error_ != 0) return;
  Buffer& buffer = buffers_[index];
  buffer = {offset_, bytes, true};
  io_uring_sqe* entry = io_uring_get_sqe(&ring_->ring);  // there is one for each buffer
  io_uring_prep_write_fixed(entry, fd_, memory_ + index * buffer_bytes_,
                            static_cast<unsigned>(bytes), offset_, static_cast<int>(index));
  io_uring_sqe_set_data64(entry, index);
  offset_ += bytes;
  ++away_;
  if (const int result = io_uring_submit(&ring_->ring); result < 0) completed(index, result);
}

void RingFile::reap() noexcept {
  io_uring_cqe* entry = nullptr;
  while (away_ != 0 && io_uring_peek_cqe(&ring_->ring, &entry) == 0) {
    const auto index = static_cast<std::size_t>(io_uring_cqe_get_data64(entry));
    const int result = entry->res;
    io_uring_cqe_seen(&ring_->ring, entry);
    completed(index, result);
  }
}

// Writes end in any order: all is written up to the first one that is still away, or has failed.
void RingFile::completed(std::size_t index, int result) noexcept {
  Buffer& buffer = buffers_[index];
  --away_;
  buffer.is_away = false;
  const bool is_whole = result >= 0 && static_cast<std::size_t>(result) == buffer.bytes;
  if (!is_whole) {
    if (error_ == 0) {
      error_ = result < 0 ? -result : ENOSPC;  // the kernel says so when it is asked again
      written_ = buffer.begin;
    }
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
  io_uring_cqe* entry = nullptr;
  while (away_ != 0) {
    const int result = io_uring_wait_cqe(&ring_->ring, &entry);
    if (result == -EINTR) continue;
    if (result < 0) {
      error_ = -result;
      break;
    }
    reap();
  }
  return error_ == 0;
}

void RingFile::cut(std::uint64_t end) noexcept {
  finish();
  if (ftruncate(fd_, static_cast<off_t>(end)) != 0) return;
  offset_ = written_ = end;
  error_ = 0;
}

}  // namespace takt
