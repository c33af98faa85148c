// SPDX-License-Identifier: Apache-2.0
#include "run/construction.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/planning/plan.hpp"

#include "run/child_output.hpp"
#include "run/live_line.hpp"

namespace takt::tools {
namespace {

// Limit: time in which the components of a process must be constructed for `takt check`. At it: the
// child is killed. Seen: the error.
constexpr auto kMostTime = std::chrono::milliseconds(30000);

/// The child writes it last: it ended neither before nor by itself.
constexpr char kDone = '\0';

ContainerOverrides only_constructs() {
  return {.only_constructs = true};
}

/// Of a whole system the analysis finds more: what its nodes make does not fit the file.
void construct_whole(const SystemDescription& system) {
  std::vector<std::unique_ptr<Container>> containers;
  std::vector<ModelledProcess> processes;
  std::vector<std::shared_ptr<Node>> nodes;
  for (SystemDescription& process : split(system, Composition::file)) {
    process.dds.reset();
    containers.push_back(std::make_unique<Container>(process, only_constructs()));
    processes.push_back(containers.back()->modelled());
    for (const auto& member : processes.back().nodes) nodes.push_back(member.node);
  }
  std::vector<std::string> errors;
  const std::vector<PlannedChain> chains = find_chains(system, nodes, errors);
  if (!errors.empty()) throw ConfigurationError(errors);
  make_system_model(system, chains, processes);
}

/// In the child. One line for each error.
std::string construct(const SystemDescription& system, Construct what) {
  try {
    if (what == Construct::process) {
      const Container container(system, only_constructs());
    } else {
      construct_whole(system);
    }
    return "";
  } catch (const ConfigurationError& error) {
    return fmt::format("{}\n", fmt::join(error.errors(), "\n"));
  } catch (const std::exception& error) {
    const std::string text = error.what();  // it may begin with its line
    return text.starts_with(system.file) ? text + "\n" : fmt::format("{}: {}\n", system.file, text);
  } catch (...) {
    return fmt::format("{}: a component threw an object that is not a std::exception\n",
                       system.file);
  }
}

/// What the child wrote, up to kDone or its end.
std::string answer_of(pid_t child, int pipe, bool& is_late) {
  const LiveLine line("constructing the components");
  const TimePoint limit = later(Clock::steady().now(), kMostTime);
  ChildOutput output(child, pipe);
  while (output.text().find(kDone) == std::string::npos) {
    if (!output.wait(between(Clock::steady().now(), limit))) break;
    is_late = Clock::steady().now() >= limit;
    if (is_late) {
      kill(child, SIGKILL);
      break;
    }
  }
  return output.text();
}

}  // namespace

std::vector<std::string> errors_of_construction(SystemDescription process, Construct what) {
  if (process.dds) {
    process.dds->discovery = DiscoveryRange::off;
    process.dds->shared_memory = SharedMemory::off;
  }
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0) {
    throw Error("cannot create a pipe: " + errno_message(errno));
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    dup2(STDERR_FILENO, STDOUT_FILENO);  // what constructors print is no result of takt
    const std::string errors = construct(process, what) + kDone;
    const ssize_t written = write(pipe_ends[1], errors.data(), errors.size());
    _exit(written == static_cast<ssize_t>(errors.size()) ? 0 : 1);
  }
  close(pipe_ends[1]);
  bool is_late = false;
  std::string text = answer_of(child, pipe_ends[0], is_late);
  int status = 0;
  waitpid(child, &status, 0);
  const std::size_t done = text.find(kDone);
  const bool is_done = done != text.npos;
  text.resize(std::min(done, text.size()));
  std::vector<std::string> errors;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    errors.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (is_late) {
    errors.push_back(
        fmt::format("{}: the components of '{}' were not constructed within {} s; "
                    "look for a constructor that waits",
                    process.file, process.name, kMostTime / std::chrono::seconds(1)));
  } else if (!is_done && WIFSIGNALED(status)) {
    errors.push_back(
        fmt::format("{}: {} ended the construction of '{}'; construct it under a "
                    "debugger: gdb --args takt plan {}",
                    process.file, strsignal(WTERMSIG(status)), process.name, process.file));
  } else if (!is_done) {
    errors.push_back(
        fmt::format("{}: a component of '{}' ended the process; a constructor may "
                    "throw, but not exit",
                    process.file, process.name));
  }
  return errors;
}

}  // namespace takt::tools
