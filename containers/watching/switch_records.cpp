// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/switch_records.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"

namespace takt {
namespace {

// Limit: bytes of switches of a CPU that wait for a look, 64 for each. At it: further ones are not
// seen, or the oldest go. Seen: a note of the result; the begin of the CPU's row in a trace.
constexpr std::size_t kMostRecordBytes = std::size_t{1} << 20;

// Limit: bytes of a file of tracefs. At it: there are no wake-ups. Seen: the trace says why.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 16;
constexpr const char* kWakeups = "/sys/kernel/tracing/events/sched/sched_waking/";

perf_event_attr wanted(SwitchRecords::Full full) {
  perf_event_attr result{};
  result.type = PERF_TYPE_SOFTWARE;
  result.size = sizeof(result);
  result.config = PERF_COUNT_SW_DUMMY;
  result.sample_type = PERF_SAMPLE_TID | PERF_SAMPLE_TIME;
  result.sample_id_all = 1;
  result.use_clockid = 1;
  result.clockid = CLOCK_MONOTONIC;
  result.write_backward = full == SwitchRecords::Full::overwrites ? 1 : 0;
  return result;
}

int open_event(perf_event_attr& event, int cpu) {
  const long fd = syscall(SYS_perf_event_open, &event, -1, cpu, -1, PERF_FLAG_FD_CLOEXEC);
  if (fd < 0) throw Error("perf_event_open: " + errno_message(errno));
  return static_cast<int>(fd);
}

}  // namespace

SwitchRecords::SwitchRecords(int cpu, Full full, bool has_wakeups)
    : full_(full), page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
  perf_event_attr switches = wanted(full);
  switches.context_switch = 1;
  switches.exclude_kernel = switches.exclude_hv = 1;
  fd_ = open_event(switches, cpu);
  const int access = full == Full::overwrites ? PROT_READ : PROT_READ | PROT_WRITE;
  memory_ = mmap(nullptr, page_ + kMostRecordBytes, access, MAP_SHARED, fd_, 0);
  if (memory_ == MAP_FAILED) {
    const int error = errno;
    close(fd_);
    throw Error("perf_event_open: " + errno_message(error));
  }
  if (has_wakeups) open_wakeups(cpu);
}

SwitchRecords::~SwitchRecords() {
  if (wakeups_fd_ >= 0) close(wakeups_fd_);
  munmap(memory_, page_ + kMostRecordBytes);
  close(fd_);
}

// The kernel's tracepoint writes into the same ring buffer. Only tracefs has its id, and the offset
// of the woken thread in its records.
void SwitchRecords::open_wakeups(int cpu) {
  std::uint64_t id = 0;
  try {
    constexpr std::string_view kPlace = "pid_t pid;\toffset:";
    id = std::stoull(read_text(std::string(kWakeups) + "id", kMostTextBytes));
    const std::string format = read_text(std::string(kWakeups) + "format", kMostTextBytes);
    const std::size_t at = format.find(kPlace);
    if (at == std::string::npos) throw Error("its records have no thread");
    woken_at_ = std::stoul(format.substr(at + kPlace.size()));
  } catch (const std::exception&) {
    without_wakeups_ = fmt::format("{} cannot be read: mount tracefs there, as root", kWakeups);
    return;
  }
  perf_event_attr wakeups = wanted(full_);
  wakeups.type = PERF_TYPE_TRACEPOINT;
  wakeups.config = id;
  wakeups.sample_period = 1;
  wakeups.sample_type |= PERF_SAMPLE_RAW;
  try {
    wakeups_fd_ = open_event(wakeups, cpu);
  } catch (const Error& error) {
    without_wakeups_ = error.what();
    return;
  }
  if (ioctl(wakeups_fd_, PERF_EVENT_IOC_SET_OUTPUT, fd_) != 0)
    without_wakeups_ = "perf_event_open: " + errno_message(errno);
}

template <class T>
T SwitchRecords::read(std::uint64_t at) const {
  std::array<char, sizeof(T)> bytes;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bytes[i] = static_cast<const char*>(memory_)[page_ + (at + i) % kMostRecordBytes];
  }
  return std::bit_cast<T>(bytes);
}

// perf_event_open(2) describes the records. A switch has two: of the thread that is switched out,
// and of the thread that is switched in. The first is missing if its thread has ended.
void SwitchRecords::visit_one(const Header& header, std::uint64_t at, const Visit& visit) {
  const std::uint64_t body = at + sizeof(header);
  const auto time = [&](std::uint64_t place) {
    return TimePoint(Nanoseconds(read<std::int64_t>(place)));
  };
  if (header.type == PERF_RECORD_SAMPLE) {
    const auto [process, thread] = read<std::array<std::uint32_t, 2>>(body);
    // After the time come the length of the tracepoint's data, and the data.
    return visit({.time = time(body + 8),
                  .process = process,
                  .thread = thread,
                  .next_thread = read<std::uint32_t>(body + 20 + woken_at_),
                  .is_wakeup = true});
  }
  if (header.type != PERF_RECORD_SWITCH_CPU_WIDE) return;
  const auto [other_process, other_thread, process, thread] =
      read<std::array<std::uint32_t, 4>>(body);
  if ((header.misc & PERF_RECORD_MISC_SWITCH_OUT) != 0) {
    comes_ = other_thread;
    visit({.time = time(body + 16),
           .process = process,
           .thread = thread,
           .next_process = other_process,
           .next_thread = other_thread,
           .was_preempted = (header.misc & PERF_RECORD_MISC_SWITCH_OUT_PREEMPT) != 0});
  } else if (std::exchange(comes_, thread) != thread) {
    visit({.time = time(body + 16),
           .process = other_process,
           .thread = other_thread,
           .next_process = process,
           .next_thread = thread});
  }
}

bool SwitchRecords::visit(const Visit& visit) {
  if (full_ == Full::loses) return visit_new(visit);
  visit_all(visit);
  return true;
}

bool SwitchRecords::visit_new(const Visit& visit) {
  auto& head = *static_cast<perf_event_mmap_page*>(memory_);
  // Acquire: pairs with the kernel's release, after what it has written.
  const std::uint64_t end = __atomic_load_n(&head.data_head, __ATOMIC_ACQUIRE);
  bool is_complete = true;
  std::uint64_t at = head.data_tail;
  while (at < end) {
    const auto header = read<Header>(at);
    if (header.size == 0) break;
    is_complete = is_complete && header.type != PERF_RECORD_LOST;
    visit_one(header, at, visit);
    at += header.size;
  }
  // Release: the kernel writes there only after we have read.
  __atomic_store_n(&head.data_tail, at, __ATOMIC_RELEASE);
  return is_complete;
}

// The kernel writes this ring buffer backwards, so the records after the head are older. They end
// where the kernel has not written yet, or, after a full turn, in a partly overwritten record.
void SwitchRecords::visit_all(const Visit& visit) {
  for (const int fd : {fd_, wakeups_fd_}) {
    if (fd >= 0) ioctl(fd, PERF_EVENT_IOC_DISABLE, 0);
  }
  const auto& page = *static_cast<const perf_event_mmap_page*>(memory_);
  // Acquire: as in visit_new().
  const std::uint64_t begin = __atomic_load_n(&page.data_head, __ATOMIC_ACQUIRE);
  std::vector<std::uint64_t> places;
  for (std::uint64_t at = begin; at - begin < kMostRecordBytes;) {
    const auto header = read<Header>(at);
    if (header.size == 0 || at + header.size - begin > kMostRecordBytes) break;
    places.push_back(at);
    at += header.size;
  }
  std::for_each(places.rbegin(), places.rend(),
                [&](std::uint64_t at) { visit_one(read<Header>(at), at, visit); });
}

}  // namespace takt
