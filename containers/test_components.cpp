// A library of components, good or broken as the macro says, for loading_test.cpp,
// library_trial_test.cpp and output_test.py.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/version.hpp"
#ifdef TAKT_TEST_OLD
#undef TAKT_VERSION
#define TAKT_VERSION "0.0.1"
#endif
#include "takt/containers/component.hpp"

#ifdef TAKT_TEST_UNDEFINED
void nowhere();
#endif

#ifdef TAKT_TEST_CRASHES
#include <csignal>

namespace {
struct Crashing {
  ~Crashing() { raise(SIGABRT); }
} crashing;
}  // namespace
#endif

#if defined TAKT_TEST_THROWS || defined TAKT_TEST_ENDS || defined TAKT_TEST_HANGS
#include <cstdlib>
#include <stdexcept>

#include <unistd.h>

namespace {
// An initialiser against which no program that loads this library can protect itself.
const int initialised = [] {
#if defined TAKT_TEST_THROWS
  throw std::runtime_error("no camera");
#elif defined TAKT_TEST_ENDS
  std::_Exit(0);
#else
  for (;;) pause();
#endif
  return 0;
}();
}  // namespace
#endif

namespace guests {

class Good : public takt::Node {
 public:
  explicit Good(const takt::NodeOptions& options) : Node("good", options) {
#ifdef TAKT_TEST_UNDEFINED
    nowhere();
#endif
#ifdef TAKT_TEST_INT
    timer_ = create_timer("tick", std::chrono::milliseconds(1), [] { throw 42; });
#endif
  }

#ifdef TAKT_TEST_INT
 private:
  std::shared_ptr<takt::Timer> timer_;
#endif
};

}  // namespace guests

TAKT_REGISTER_COMPONENT(guests::Good)
