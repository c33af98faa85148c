// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/preemptions.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {
namespace {

// Limit: bytes of switches of a CPU that wait for a look, 32 for each. At it: further ones are not
// seen. Seen: a note of the result.
constexpr std::size_t kMostRecordBytes = std::size_t{1} << 20;
// Limit: threads of others that are told apart in a look. At it: the rest is one. Seen: "others".
constexpr std::size_t kMostPreemptors = 20;

std::string name_of_process_thread(std::uint32_t process, std::uint32_t thread) {
  std::string name;
  std::getline(std::ifstream(fmt::format("/proc/{}/task/{}/comm", process, thread)), name);
  return fmt::format("'{}' (process {})", name.empty() ? "?" : name, process);
}

/// A child of the same parent is a process of the same system: its threads are in the file.
bool is_of_this_system(std::uint32_t process) {
  std::ifstream file(fmt::format("/proc/{}/status", process));
  for (std::string word; file >> word;) {
    if (word != "PPid:") continue;
    pid_t parent = 0;
    file >> parent;
    return parent == getppid() && parent > 1;
  }
  return false;
}

bool shares_cpu(const std::vector<int>& a, const std::vector<int>& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

std::vector<ThreadState> realtime_ones(const std::vector<int>& threads) {
  std::vector<ThreadState> result;
  for (const int thread : threads) {
    ThreadState state = thread_state(thread);
    if (is_realtime(state.policy)) result.push_back(std::move(state));
  }
  return result;
}

}  // namespace

/// The switches of a CPU, as the kernel writes them into a ring.
class Preemptions::Records {
 public:
  struct Switch {
    std::uint32_t process = 0, thread = 0;            // that goes
    std::uint32_t next_process = 0, next_thread = 0;  // that comes
  };

  explicit Records(int cpu) {
    perf_event_attr wanted{};
    wanted.type = PERF_TYPE_SOFTWARE;
    wanted.size = sizeof(wanted);
    wanted.config = PERF_COUNT_SW_DUMMY;
    wanted.sample_type = PERF_SAMPLE_TID;
    wanted.sample_id_all = 1;
    wanted.context_switch = 1;
    wanted.exclude_kernel = wanted.exclude_hv = 1;
    fd_ =
        static_cast<int>(syscall(SYS_perf_event_open, &wanted, -1, cpu, -1, PERF_FLAG_FD_CLOEXEC));
    if (fd_ < 0) throw Error("perf_event_open: " + errno_message(errno));
    memory_ = mmap(nullptr, page_ + kMostRecordBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
    if (memory_ == MAP_FAILED) {
      const int error = errno;
      close(fd_);
      throw Error("perf_event_open: " + errno_message(error));
    }
  }
  ~Records() {
    munmap(memory_, page_ + kMostRecordBytes);
    close(fd_);
  }
  Records(const Records&) = delete;
  Records& operator=(const Records&) = delete;

  /// Calls it with each preemption since the last time. Returns false if some were not recorded.
  template <class Visit>
  bool visit(Visit&& visit) {
    auto& head = *static_cast<perf_event_mmap_page*>(memory_);
    // Acquire: pairs with the kernel's release, after what it has written.
    const std::uint64_t end = __atomic_load_n(&head.data_head, __ATOMIC_ACQUIRE);
    bool is_complete = true;
    std::uint64_t at = head.data_tail;
    while (at < end) {
      const auto header = read<perf_event_header>(at);
      if (header.size == 0) break;
      is_complete = is_complete && header.type != PERF_RECORD_LOST;
      constexpr unsigned kPreempted =
          PERF_RECORD_MISC_SWITCH_OUT | PERF_RECORD_MISC_SWITCH_OUT_PREEMPT;
      if (header.type == PERF_RECORD_SWITCH_CPU_WIDE && (header.misc & kPreempted) == kPreempted) {
        const auto [next_process, next_thread, process, thread] =
            read<std::array<std::uint32_t, 4>>(at + sizeof(header));
        visit(Switch{process, thread, next_process, next_thread});
      }
      at += header.size;
    }
    // Release: the kernel writes there only after we have read.
    __atomic_store_n(&head.data_tail, at, __ATOMIC_RELEASE);
    return is_complete;
  }

 private:
  template <class T>
  T read(std::uint64_t at) const {
    std::array<char, sizeof(T)> bytes;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes[i] = static_cast<const char*>(memory_)[page_ + (at + i) % kMostRecordBytes];
    }
    return std::bit_cast<T>(bytes);
  }

  const std::size_t page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  int fd_ = -1;
  void* memory_ = nullptr;
};

Preemptions::Preemptions() = default;
Preemptions::~Preemptions() = default;

void Preemptions::begin(const std::vector<int>& threads) {
  std::set<int> cpus;
  for (const ThreadState& thread : realtime_ones(threads)) {
    cpus.insert(thread.affinity.begin(), thread.affinity.end());
  }
  try {
    for (const int cpu : cpus) records_.push_back(std::make_unique<Records>(cpu));
  } catch (const Error& error) {
    records_.clear();
    note_ = fmt::format("who ran before the threads of callbacks was checked coarsely: {}",
                        error.what());
  }
  look(threads);  // what was before does not count
}

std::vector<Preemptions::Found> Preemptions::look(const std::vector<int>& threads) {
  return records_.empty() ? by_counts(threads) : by_records(threads);
}

std::vector<Preemptions::Found> Preemptions::by_records(const std::vector<int>& threads) {
  const std::vector<ThreadState> ours = realtime_ones(threads);
  const auto own = static_cast<std::uint32_t>(getpid());
  const auto find = [&](std::uint32_t thread) {
    return std::find_if(ours.begin(), ours.end(), [&](const ThreadState& state) {
      return state.tid == static_cast<int>(thread);
    });
  };
  std::map<std::uint32_t, bool> is_of_system;
  std::map<std::pair<std::string, std::string>, Found> found;
  for (const auto& records : records_) {
    const bool is_complete = records->visit([&](const Records::Switch& change) {
      const auto preempted = find(change.thread);
      if (change.process != own || preempted == ours.end() || change.next_thread == 0) return;
      if (change.next_process == own && find(change.next_thread) != ours.end()) return;
      const auto [known, is_new] = is_of_system.try_emplace(change.next_process);
      if (is_new) {
        known->second = change.next_process != own && is_of_this_system(change.next_process);
      }
      if (known->second) return;
      const std::string by = found.size() < kMostPreemptors
                                 ? name_of_process_thread(change.next_process, change.next_thread)
                                 : "others";
      Found& one = found[{by, preempted->name}];
      one.by = by;
      one.thread = preempted->name;
      one.is_ours = change.next_process == own;
      ++one.count;
    });
    if (!is_complete && note_.empty()) {
      note_ = "switches of threads were too many to be recorded: some were not seen";
    }
  }
  std::vector<Found> result;
  for (auto& [key, one] : found) result.push_back(std::move(one));
  return result;
}

// A thread that others of the file may preempt tells nothing.
std::vector<Preemptions::Found> Preemptions::by_counts(const std::vector<int>& threads) {
  const std::vector<ThreadState> ours = realtime_ones(threads);
  std::vector<Found> result;
  for (const ThreadState& thread : ours) {
    const auto usage = thread_usage(thread.tid);
    if (!usage) continue;
    const auto [before, is_new] = counts_.try_emplace(thread.tid, usage->involuntary_switches);
    const std::uint64_t count = usage->involuntary_switches - before->second;
    before->second = usage->involuntary_switches;
    const bool has_rival = std::any_of(ours.begin(), ours.end(), [&](const ThreadState& other) {
      return other.tid != thread.tid && shares_cpu(other.affinity, thread.affinity) &&
             (other.policy == ThreadPolicy::deadline || other.priority >= thread.priority);
    });
    if (is_new || has_rival || count == 0 || thread.policy == ThreadPolicy::deadline) continue;
    result.push_back({.thread = thread.name, .count = count});
  }
  return result;
}

}  // namespace takt
