// takt_try_library LIBTAKT LIBRARY: loads the library as a program that links libtakt would, writes
// a zero byte when it is loaded, and exits. Static initialisers that throw, exit or hang do so
// here, and so do destructors that crash (library_trial.hpp).
// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <cstdio>

#include <dlfcn.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // the parent may have ended already: see poll()
  pollfd reader{STDOUT_FILENO, 0, 0};
  if (poll(&reader, 1, 0) > 0) return 2;
  const rlimit none{};
  setrlimit(RLIMIT_CORE, &none);  // no core files: crashes are expected here
  void* const takt = dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL);
  void* const load = takt != nullptr ? dlsym(takt, "takt_try_library") : nullptr;
  if (load == nullptr) {
    std::fprintf(stderr, "%s\n", dlerror());
    return 2;
  }
  reinterpret_cast<void (*)(const char*)>(load)(argv[2]);
  const ssize_t written = write(STDOUT_FILENO, "", 1);
  if (written != 1) _exit(1);
  return 0;
}
