// The library libtakt_simulated, which `takt simulate FILE -- PROGRAM` preloads: takes the place of
// what makes threads, sleeps, and reads clocks. The program is refused if it calls that; Takt
// itself goes on to the C library.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <ctime>
#include <string_view>

#include <dlfcn.h>
#include <execinfo.h>
#include <poll.h>
#include <pthread.h>
#include <sys/select.h>
#include <sys/time.h>
#include <unistd.h>

extern "C" {
// Weak: a program that a program starts may have no Takt.
[[gnu::weak]] void takt_refuse_call(const char* function, const char* caller) noexcept;
void takt_simulated_is_loaded() noexcept;
}

namespace {

// What backtrace() and the refusal itself call.
thread_local bool is_looking = false;

bool is_passed_over(std::string_view library) {
  for (const std::string_view name : {"libtakt_simulated.", "libstdc++.", "libc++.", "libc."}) {
    if (library.starts_with(name)) return true;
  }
  return false;
}

/// Refuses it if the first caller that is no library of the language is none of Takt's, either.
void look(const char* function) {
  if (takt_refuse_call == nullptr || is_looking) return;
  is_looking = true;
  std::array<void*, 16> frames{};
  const int count = backtrace(frames.data(), frames.size());
  for (int i = 0; i < count; ++i) {
    Dl_info of{};
    if (dladdr(frames[static_cast<std::size_t>(i)], &of) == 0 || of.dli_fname == nullptr) continue;
    const std::string_view path = of.dli_fname;
    const std::string_view name = path.substr(path.rfind('/') + 1);
    if (is_passed_over(name)) continue;
    if (!name.starts_with("libtakt")) takt_refuse_call(function, of.dli_fname);
    break;
  }
  is_looking = false;
}

template <class Function>
Function* next(Function* /*unused*/, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// NOLINTBEGIN(bugprone-macro-parentheses): of declarations.
#define TAKT_LOOK_AT(result, name, declared, given) \
  result name declared {                            \
    look(#name);                                    \
    static auto* const real = next(&::name, #name); \
    return real given;                              \
  }

extern "C" {
/// A program that finds it has this library.
void takt_simulated_is_loaded() noexcept {
}

TAKT_LOOK_AT(int, pthread_create,
             (pthread_t * thread, const pthread_attr_t* attributes, void* (*run)(void*),
              void* what) noexcept,
             (thread, attributes, run, what))
TAKT_LOOK_AT(unsigned, sleep, (unsigned seconds), (seconds))
TAKT_LOOK_AT(int, usleep, (useconds_t time), (time))
TAKT_LOOK_AT(int, nanosleep, (const timespec* time, timespec* left), (time, left))
TAKT_LOOK_AT(int, clock_nanosleep,
             (clockid_t clock, int flags, const timespec* time, timespec* left),
             (clock, flags, time, left))
TAKT_LOOK_AT(int, poll, (pollfd * files, nfds_t count, int time), (files, count, time))
TAKT_LOOK_AT(int, select, (int count, fd_set* in, fd_set* out, fd_set* bad, timeval* time),
             (count, in, out, bad, time))
TAKT_LOOK_AT(int, clock_gettime, (clockid_t clock, timespec* time) noexcept, (clock, time))
TAKT_LOOK_AT(int, gettimeofday, (timeval * time, void* zone) noexcept, (time, zone))
TAKT_LOOK_AT(time_t, time, (time_t * time) noexcept, (time))
}
// NOLINTEND(bugprone-macro-parentheses)
