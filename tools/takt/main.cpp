// takt: runs systems described by a file, and compares executors on them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <new>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "prompt/mistakes.hpp"

namespace {

int run(int argc, char** argv) {
  using namespace takt;
  CLI::App app("Takt: real-time executors with swappable schedulers", "takt");
  std::vector<std::string> words;
  try {
    tools::set_up(app);
    const int count = tools::split_program(argc, argv);
    words.assign(argv + std::min(count, 1), argv + count);
    app.parse(count, argv);
    return 0;
  } catch (const CLI::RuntimeError& error) {  // a command failed; not a usage error
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
    rt::to_stderr("takt: {}\n", tools::mistake(app, error, words));
    return tools::kBadUsage;
  } catch (const ConfigurationError& error) {
    for (const std::string& line : error.errors()) rt::to_stderr("{}\n", line);
    return tools::kBadUsage;
  } catch (const Error& error) {
    rt::to_stderr("takt: {}\n", error.what());
    const bool is_usage = dynamic_cast<const tools::UsageError*>(&error) != nullptr;
    return is_usage ? tools::kBadUsage : tools::status_of_error();
  } catch (const tools::Interrupted& interruption) {
    rt::to_stderr("takt: {}\n", interruption.what());
    return 128 + interruption.signal;
  } catch (const std::bad_alloc&) {
    throw;  // to where nothing is allocated
  } catch (const std::exception& error) {
    rt::to_stderr("takt: {}\n", tools::message_of(error));
    return tools::kFailed;
  }
}

/// Each thread that chooses no size of its own has a stack of that limit, and iceoryx keeps lists
/// of 256 KiB on it.
bool has_stack() noexcept {
  constexpr rlim_t kLeast = rlim_t{1} << 20;
  rlimit stack{};
  return getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kLeast;
}

/// Nothing is thrown out of main, neither while options are set up nor while an error is reported.
int run_in_net(int argc, char** argv) noexcept {
  try {
    return run(argc, argv);
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
  if (!has_stack()) {
    std::fputs("takt: stacks have less than 1 MiB; raise the limit (ulimit -s)\n", stderr);
    return takt::tools::kBadUsage;
  }
  takt::rt::guard_output();
  return takt::rt::checked_output(run_in_net(argc, argv));
}
