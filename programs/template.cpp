// SPDX-License-Identifier: Apache-2.0
#include "takt/programs/template.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <set>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/programs/results.hpp"

namespace takt::programs {
namespace {

[[noreturn]] void exists(const std::string& path) {
  throw Error("the file exists, and is not overwritten",
              "name another one, or start the program with TAKT_CONFIG=" + path,
              "TAKT_CONFIG_TEMPLATE=" + path);
}

}  // namespace

Template::Template(const std::string& path)
    : path_(std::filesystem::absolute(path)) {  // the program may change its folder
  if (access(path_.c_str(), F_OK) == 0) exists(path_);
  const std::string folder = std::filesystem::path(path_).parent_path();
  if (access(folder.c_str(), W_OK) == 0) return;
  throw Error("no file can be made there: " + errno_message(errno), "",
              "TAKT_CONFIG_TEMPLATE=" + path_);
}

void Template::made(const Executor& executor, const std::string& type, std::size_t threads) {
  executors_[&executor] = std::make_shared<Served>(Served{type, threads});
}

void Template::added(const std::shared_ptr<Node>& node, const CallbackGroup* group,
                     const Executor& executor) {
  const Added added{node, group != nullptr ? group->name() : "", executors_.at(&executor)};
  if (begin_ != TimePoint{}) return see(added);
  added_.push_back(added);
}

void Template::spins() {
  if (begin_ != TimePoint{}) return;
  begin_ = Clock::steady().now();
  std::vector<std::shared_ptr<Node>> nodes;
  for (const Added& added : added_) {
    see(added);
    const auto node = added.node.lock();
    if (node != nullptr && std::find(nodes.begin(), nodes.end(), node) == nodes.end()) {
      nodes.push_back(node);
    }
  }
  plan(nodes);
}

// Which callback wakes which inside the process, and what `chains: auto` would make of it.
void Template::plan(const std::vector<std::shared_ptr<Node>>& nodes) {
  SystemDescription description;
  description.finds_chains = true;
  std::vector<std::string> too_many;
  const Plan plan = make_plan(find_chains(description, nodes, too_many), nodes);
  for (const PlannedChain& chain : plan.chains) {
    std::vector<std::string> steps;
    for (const Chain::Step& step : chain.path) steps.push_back(to_string(step));
    chains_ += fmt::format("#  {}: {}\n", chain.options.name, fmt::join(steps, " -> "));
  }
  for (const Plan::Callback& planned : plan.callbacks) {
    for (Callback& callback : nodes_[planned.node->fully_qualified_name()].callbacks) {
      if (callback.name == planned.entity->name())
        callback.priority = std::max(callback.priority, planned.priority);
    }
  }
}

// A group stays with the first executor that had it: others are made for one call, `spin_some`.
void Template::see(const Added& added) {
  const auto node = added.node.lock();
  if (node == nullptr) return;
  Seen& seen = nodes_[node->fully_qualified_name()];
  std::set<std::string> fresh;
  for (const auto& group : node->groups()) {
    const bool is_meant =
        added.group.empty() ? group->automatically_add_to_executor() : group->name() == added.group;
    if (is_meant && seen.groups.try_emplace(group->name(), added.served).second) {
      fresh.insert(group->name());
    }
  }
  for (const auto& entity : node->entities()) {
    const auto is_namesake = [&](const Callback& other) { return other.name == entity->name(); };
    if (!fresh.contains(entity->group()->name()) ||
        is_parameter_service(node->fully_qualified_name(), entity->kind(), entity->name()) ||
        std::any_of(seen.callbacks.begin(), seen.callbacks.end(), is_namesake)) {
      continue;
    }
    seen.callbacks.push_back({entity->name(), entity->group()->name(), entity->kind()});
  }
}

void Template::ends(const Executor& executor) {
  executors_.erase(&executor);
  end_ = Clock::steady().now();
  for (const CallbackStatistics& measured : executor.statistics()) {
    const auto node = nodes_.find(measured.node);
    if (node == nodes_.end()) continue;
    for (Callback& callback : node->second.callbacks) {
      if (callback.name != measured.callback) continue;
      callback.is_measured = true;
      callback.received += measured.received;
      callback.execution.merge(measured.execution);
    }
  }
}

std::string Template::comment(const Callback& callback) const {
  if (callback.received == 0) {
    return fmt::format("{}, {}", to_string(callback.kind),
                       callback.is_measured ? "never called" : "not measured");
  }
  const auto us = [](Nanoseconds time) { return static_cast<double>(time.count()) / 1000; };
  return fmt::format("{}, {} ({:.1f}/s), {:.1f} us on average, {:.1f} us at most",
                     to_string(callback.kind), counted(callback.received, "call"),
                     static_cast<double>(callback.received) / seconds(),
                     us(callback.execution.mean()), us(callback.execution.max()));
}

std::string Template::text() const {
  std::vector<const Served*> all;
  for (const auto& [name, node] : nodes_) {
    for (const auto& [group, served] : node.groups) {
      if (std::find(all.begin(), all.end(), served.get()) == all.end()) all.push_back(served.get());
    }
  }
  const auto name_of = [&](const Served& served) {
    const auto place = std::find(all.begin(), all.end(), &served) - all.begin();
    return all.size() == 1 ? std::string("default") : fmt::format("executor_{}", place + 1);
  };
  std::string threads, executors, nodes;
  for (const Served* served : all) {
    std::vector<std::string> names;
    for (std::size_t i = 1; i <= served->threads; ++i) {
      names.push_back(served->threads == 1 ? name_of(*served)
                                           : fmt::format("{}_{}", name_of(*served), i));
      threads += fmt::format("  {}: {{policy: SCHED_OTHER}}\n", names.back());
    }
    executors += fmt::format("  {}: {{type: {}, threads: [{}]}}\n", name_of(*served), served->type,
                             fmt::join(names, ", "));
  }
  for (const auto& [name, node] : nodes_) {
    const Served& served = *node.groups.begin()->second;  // that of the group `default`, if any
    nodes += fmt::format("  {}:\n    executor: {}\n    callback_groups:\n", name, name_of(served));
    for (const auto& [group, own] : node.groups) {
      nodes += fmt::format("      {}: {{{}}}\n", group,
                           own.get() == &served ? "" : "executor: " + name_of(*own));
    }
    if (!node.callbacks.empty()) nodes += "    callbacks:\n";
    for (const Callback& callback : node.callbacks) {
      nodes += fmt::format("      {}: {{}}  # in {}: {}{}\n", callback.name, callback.group,
                           comment(callback),
                           callback.priority == 0
                               ? ""
                               : fmt::format("; priority {} by `chains: auto`", callback.priority));
    }
  }
  return fmt::format(
      "# The nodes of a program and how it serves them, from a run of {:.1f} s. To serve them as\n"
      "# this file says: TAKT_CONFIG={} PROGRAM\n"
      "# A thread may be {{policy: SCHED_FIFO, priority: 80, affinity: [1]}}, an executor of type "
      "events,\n# a group or callback have {{priority: 1, deadline: 5ms, budget: 1ms}}.\n"
      "realtime: prefer\nthreads:\n{}executors:\n{}nodes:\n{}{}",
      seconds(), path_, threads, executors, nodes,
      chains_.empty() ? "" : "# chains: auto  # with these chains:\n" + chains_);
}

void Template::write() {
  if (end_ == TimePoint{}) end_ = Clock::steady().now();
  if (nodes_.empty()) {
    throw Error("the program has spun no node", "", "TAKT_CONFIG_TEMPLATE=" + path_);
  }
  const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0 && errno == EEXIST) exists(path_);
  const std::string content = text();
  const bool is_written = fd >= 0 && ::write(fd, content.data(), content.size()) ==
                                         static_cast<ssize_t>(content.size());
  const int error = errno;
  if (fd >= 0) close(fd);
  if (!is_written) {
    throw Error("cannot be written: " + errno_message(error), "", "TAKT_CONFIG_TEMPLATE=" + path_);
  }
}

}  // namespace takt::programs
