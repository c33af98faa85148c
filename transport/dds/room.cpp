// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/room.hpp"

#include <semaphore>
#include <system_error>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// A few more than Cyclone 0.10 takes in measurements, with all its receive threads.
constexpr int kThreads = 10;
constexpr int kDescriptors = 12;
constexpr std::size_t kBytes = 32 << 20;  // beside the threads' stacks

[[noreturn]] void refuse(const std::string& what, const char* option) {
  throw Error("this process cannot join a DDS domain: " + what,
              fmt::format("raise this process's limit (ulimit {}), or end other programs", option));
}

void check_descriptors() {
  std::vector<int> taken;
  for (int i = 0; i < kDescriptors; ++i) {
    if (const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC); fd >= 0) taken.push_back(fd);
  }
  for (const int fd : taken) close(fd);
  if (taken.size() < kDescriptors) {
    refuse(fmt::format("it needs {} file descriptors", kDescriptors), "-n");
  }
}

void check_memory(std::size_t bytes) {
  void* const taken = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (taken == MAP_FAILED) refuse(fmt::format("it needs {} MB of memory", bytes >> 20), "-v");
  munmap(taken, bytes);
}

}  // namespace

void check_room(std::size_t mapped_bytes) {
  check_descriptors();
  std::counting_semaphore<kThreads> may_end(0);
  std::vector<std::thread> threads;
  threads.reserve(kThreads);
  const auto end = [&] {
    may_end.release(static_cast<std::ptrdiff_t>(threads.size()));
    for (std::thread& thread : threads) thread.join();
  };
  try {
    while (threads.size() < kThreads) threads.emplace_back([&] { may_end.acquire(); });
    check_memory(kBytes + mapped_bytes);
  } catch (const std::system_error&) {
    end();
    refuse(fmt::format("it needs {} threads, with their stacks", kThreads), "-u, -v");
  } catch (...) {
    end();
    throw;
  }
  end();
}

}  // namespace takt
