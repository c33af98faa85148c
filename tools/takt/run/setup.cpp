// SPDX-License-Identifier: Apache-2.0
#include "run/setup.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt::tools {
namespace {

std::string priority_of(const ThreadState& in_force) {
  const auto policy = to_string(in_force.policy);
  if (in_force.priority != 0) return fmt::format("{} {}", policy, in_force.priority);
  return in_force.nice != 0 ? fmt::format("{} nice {}", policy, in_force.nice)
                            : std::string(policy);
}

struct Aspect {
  const char* name;
  bool is_of_type;  // if nobody chooses another: so the executor's word says it
  std::string (*of)(const Setup&);
};
constexpr Aspect kAspects[] = {
    {"threads", false, [](const Setup& setup) { return setup.threads_text(); }},
    {"priorities", false, [](const Setup& setup) { return setup.priorities; }},
    {"CPUs", false, [](const Setup& setup) { return setup.cpus; }},
    {"scheduler", true, [](const Setup& setup) { return setup.schedulers; }},
};

}  // namespace

std::string Setup::threads_text() const {
  return unused != 0 ? fmt::format("{}/{}", threads, threads + unused) : std::to_string(threads);
}

Setup setup_of(const rt::Run& run) {
  Setup setup;
  std::set<std::string> priorities, cpus, schedulers;
  std::map<std::pair<std::string, std::string>, std::size_t> used;  // by process and executor
  for (const rt::Run::Executor& executor : run.executors) {
    used[{executor.process, executor.name}] = 0;
    schedulers.insert(executor.scheduler);
  }
  for (const rt::Run::Thread& thread : run.threads) {
    const auto executor = used.find({thread.process, thread.executor});
    if (executor == used.end()) continue;  // of the container itself, or of DDS
    ++executor->second;
    ++setup.threads;
    priorities.insert(priority_of(thread.in_force));
    cpus.insert(fmt::format("{}", fmt::join(thread.in_force.affinity, ",")));
  }
  for (const rt::Run::Executor& executor : run.executors) {
    const std::size_t given = executor.threads_given;
    setup.unused += given - std::min(given, used[{executor.process, executor.name}]);
  }
  setup.priorities = fmt::format("{}", fmt::join(priorities, " and "));
  setup.cpus = fmt::format("{}", fmt::join(cpus, " and "));
  setup.schedulers = fmt::format("{}", fmt::join(schedulers, " and "));
  return setup;
}

std::string difference(const Setup& setup, const Setup& other) {
  if (setup.threads == 0 || other.threads == 0) return "";
  std::vector<std::string> parts;
  for (const Aspect& aspect : kAspects) {
    const std::string here = aspect.of(setup), there = aspect.of(other);
    if (here == there || aspect.is_of_type) continue;
    parts.push_back(fmt::format("{} {} against {}", aspect.name, here, there));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<std::string> differences(std::span<const std::pair<std::string, Setup>> rows) {
  std::vector<std::string> lines;
  for (const Aspect& aspect : kAspects) {
    std::vector<std::pair<std::string, std::vector<std::string>>> rows_of;  // by value
    for (const auto& [name, setup] : rows) {
      const std::string value = aspect.of(setup);
      const auto known = std::find_if(rows_of.begin(), rows_of.end(),
                                      [&](const auto& entry) { return entry.first == value; });
      (known != rows_of.end() ? *known : rows_of.emplace_back(value, std::vector<std::string>()))
          .second.push_back(name);
    }
    if (rows_of.size() < 2) continue;
    std::vector<std::string> parts;
    for (const auto& [value, names] : rows_of) {
      parts.push_back(fmt::format("{} ({})", value, fmt::join(names, ", ")));
    }
    lines.push_back(fmt::format("{}: {}", aspect.name, fmt::join(parts, "; ")));
  }
  return lines;
}

}  // namespace takt::tools
