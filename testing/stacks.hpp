// Prints where each thread of this process is, when a test hangs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_STACKS_HPP_
#define TAKT_TESTING_STACKS_HPP_

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <dirent.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

// How it works, within a signal handler, so without memory from the heap:
// 1. print() sends each thread a signal, whose handler notes the thread's stack.
// 2. addr2line prints the functions, as it knows those that no library exports. Where there is
// none,
//    the addresses are printed.
namespace takt::stacks {

inline constexpr int kMostFrames = 60;
inline std::array<void*, kMostFrames> frames;
inline std::atomic<int> frame_count{0};

inline void note(int /*signal*/) {
  const int error = errno;
  frame_count = backtrace(frames.data(), kMostFrames);
  errno = error;
}

/// Prints frames of one file.
inline void print_functions(const char* file, const link_map& map, void** begin, int count) {
  const pid_t child = _Fork();
  if (child == 0) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    std::array<std::array<char, 20>, kMostFrames> texts;
    std::array<const char*, kMostFrames + 4> words{"addr2line", "-Cfpe", file};
    for (int i = 0; i < count; ++i) {
      char* const text = texts[static_cast<std::size_t>(i)].data();
      std::snprintf(text, 20, "%#zx",  // the call is before the address of return
                    reinterpret_cast<std::size_t>(begin[i]) - map.l_addr - 1);
      words[static_cast<std::size_t>(i) + 3] = text;
    }
    execv("/usr/bin/addr2line", const_cast<char* const*>(words.data()));
    backtrace_symbols_fd(begin, count, STDERR_FILENO);
    _exit(0);
  }
  if (child > 0) waitpid(child, nullptr, 0);
}

inline void print_thread(pid_t thread, int signal) {
  std::array<char, 60> line;
  const int size = std::snprintf(line.data(), line.size(), "thread %d:\n", thread);
  [[maybe_unused]] ssize_t said = write(STDERR_FILENO, line.data(), static_cast<std::size_t>(size));
  frame_count = 0;
  syscall(SYS_tgkill, getpid(), thread, signal);
  constexpr timespec kPause{0, 1'000'000};
  for (int i = 0; i < 500 && frame_count == 0; ++i) nanosleep(&kPause, nullptr);
  const int count = frame_count;
  if (count == 0) said = write(STDERR_FILENO, "blocks all signals\n", 19);
  for (int begin = 2, end = begin; begin < count; begin = end) {  // without the handler's two
    Dl_info of_first{}, other{};
    link_map* map = nullptr;
    if (dladdr1(frames[begin], &of_first, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) == 0) {
      ++end;
      continue;
    }
    while (end < count && dladdr(frames[end], &other) != 0 &&
           other.dli_fbase == of_first.dli_fbase) {
      ++end;
    }
    print_functions(of_first.dli_fname, *map, &frames[begin], end - begin);
  }
}

/// Before print(), once: the first stack needs the heap.
inline void prepare() {
  backtrace(frames.data(), kMostFrames);
}

/// Prints the stacks of all threads to stderr. From any thread, also in a signal handler.
inline void print() {
  const int signal = SIGRTMIN + 7;  // nobody else has it
  std::signal(signal, note);
  const int folder = open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  alignas(dirent64) std::array<char, 1024> buffer;
  for (long size; (size = syscall(SYS_getdents64, folder, buffer.data(), buffer.size())) > 0;) {
    for (long at = 0; at < size;) {
      const auto* const entry = reinterpret_cast<const dirent64*>(&buffer[at]);
      if (const pid_t thread = std::atoi(entry->d_name); thread > 0) print_thread(thread, signal);
      at += entry->d_reclen;
    }
  }
  close(folder);
}

}  // namespace takt::stacks

#endif  // TAKT_TESTING_STACKS_HPP_
