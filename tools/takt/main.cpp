// takt: runs systems described by a file, and compares executors on them.
// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <cstdio>
#include <new>
#include <string_view>

#include <sys/resource.h>

#include "takt/measuring/output.hpp"

#include "exit_status.hpp"
#include "run_takt.hpp"

namespace {

/// Each thread that chooses no size of its own has a stack of that limit, and iceoryx keeps lists
/// of 256 KiB on it.
bool has_stack() noexcept {
  constexpr rlim_t kLeast = rlim_t{1} << 20;
  rlimit stack{};
  return getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kLeast;
}

/// The process that started this command may have blocked them, for a thread of its own that takes
/// them: then they would not end it. A process of a run leaves them to the one that controls it.
void unblock_signals(int argc, char** argv) noexcept {
  const bool is_controlled = argc > 2 && std::string_view(argv[argc - 2]) == "--connection";
  if (is_controlled) return;
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

/// Nothing is thrown out of main, neither while options are set up nor while an error is reported.
int run_in_net(int argc, char** argv) noexcept {
  try {
    return takt::tools::run_takt(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("takt: no memory is left; raise the limit (ulimit -v), or end other programs\n",
               stderr);
  } catch (...) {
    std::fprintf(stderr, "takt: %s\n", takt::tools::kNoStdException);
  }
  return takt::tools::kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  unblock_signals(argc, argv);
  if (!has_stack()) {
    std::fputs("takt: stacks have less than 1 MiB; raise the limit (ulimit -s)\n", stderr);
    return takt::tools::kBadUsage;
  }
  takt::rt::guard_output();
  return takt::rt::checked_output(run_in_net(argc, argv));
}
