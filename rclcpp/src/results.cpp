// SPDX-License-Identifier: Apache-2.0
#include "results.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/process_json.hpp"
#include "takt/nodes/node.hpp"

namespace rclcpp::detail {
namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw takt::Error("cannot be written: " + takt::errno_message(errno),
                    "choose a writable file on a disk with free space", "TAKT_RESULTS=" + path);
}

template <class Rows, class Row, class Key>
Row* find(Rows& rows, const Row& like, const Key& key) {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return key(row) == key(like); });
  return found != rows.end() ? &*found : nullptr;
}

}  // namespace

Results::Results(std::string path) : path_(std::move(path)) {
  if (!std::ofstream(path_, std::ios::app)) refuse(path_);
  sum_.name = program_invocation_short_name;
}

void Results::spins() {
  if (begin_ != takt::TimePoint{}) return;
  begin_ = takt::Clock::steady().now();
  cpu_time_before_ = takt::process_cpu_time();
}

void Results::has_spun() {
  const auto seconds = [](takt::Nanoseconds time) {
    return std::chrono::duration<double>(time).count();
  };
  sum_.duration_s = seconds(takt::Clock::steady().now() - begin_);
  sum_.cpu_percent = 100 * seconds(takt::process_cpu_time() - cpu_time_before_) / sum_.duration_s;
  sum_.pss_kb = takt::proportional_set_size_kb();
}

void Results::made(const takt::Executor& executor, const std::string& type,
                   const std::string& scheduler) {
  executors_[&executor] = {
      type, scheduler.empty() ? takt::executors().traits(type).scheduler : scheduler};
}

void Results::added(const std::shared_ptr<takt::Node>& node) {
  std::erase_if(nodes_, [&](const auto& known) { return known.expired() || known.lock() == node; });
  nodes_.push_back(node);
}

void Results::ends(const takt::Executor& executor) {
  const auto kind = executors_.extract(&executor);
  takt::ProcessResult part;
  for (takt::CallbackStatistics& callback : executor.statistics()) {
    part.callbacks.push_back({kind.mapped().executor, std::move(callback)});
  }
  if (part.callbacks.empty()) return;
  for (takt::ThreadStatistics& thread : executor.thread_statistics()) {
    if (!thread.in_force.refused.empty()) part.notes.push_back(thread.in_force.refused);
    part.threads.push_back({kind.mapped().executor, std::move(thread), kind.mapped().executor,
                            kind.mapped().scheduler});
  }
  add(part);
}

void Results::add(const takt::ProcessResult& part) {
  for (takt::ProcessResult::Callback more : part.callbacks) {
    takt::CallbackStatistics& of = more.statistics;
    if (is_parameter_service(of.node, of.kind, of.callback)) continue;
    if (of.kind == takt::EntityKind::subscription) count_since_last_time(of);
    auto* const row = find(sum_.callbacks, more, [](const auto& callback) {
      const takt::CallbackStatistics& name = callback.statistics;
      return std::tie(callback.executor, name.node, name.group, name.callback, name.kind);
    });
    if (row != nullptr) {
      row->statistics.add(more.statistics);
    } else {
      sum_.callbacks.push_back(more);
    }
  }
  for (const auto& more : part.threads) {
    auto* const row = find(sum_.threads, more, [](const auto& thread) {
      return std::tie(thread.executor, thread.statistics.in_force.tid);
    });
    if (row != nullptr) {
      row->statistics.add(more.statistics);
    } else {
      sum_.threads.push_back(more);
    }
  }
  for (const auto& more : part.chains) {
    auto* const row =
        find(sum_.chains, more, [](const auto& chain) { return std::tie(chain.name); });
    if (row != nullptr) {
      row->statistics.add(more.statistics);
    } else {
      sum_.chains.push_back(more);
    }
  }
  for (const std::string& text : part.notes) note(text);
}

// A program does not wait until all is served, and another executor may go on with it.
void Results::count_since_last_time(takt::CallbackStatistics& of) {
  const Sent now{of.expected - std::min(of.expected, waiting(of)), of.dropped, of.from_outside};
  Sent& before = sent_[{of.node, of.callback}];
  if (now.expected < before.expected || now.dropped < before.dropped) before = {};  // a new one
  of.expected = now.expected - before.expected;
  of.dropped = now.dropped - before.dropped;
  of.from_outside = now.from_outside - std::min(now.from_outside, before.from_outside);
  before = now;
}

std::uint64_t Results::waiting(const takt::CallbackStatistics& of) const {
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (node == nullptr || node->fully_qualified_name() != of.node) continue;
    for (const auto& entity : node->entities()) {
      if (entity->kind() == of.kind && entity->name() == of.callback) return entity->ready_count();
    }
  }
  return 0;
}

void Results::note(const std::string& text) {
  if (std::find(sum_.notes.begin(), sum_.notes.end(), text) == sum_.notes.end()) {
    sum_.notes.push_back(text);
  }
}

void Results::write(const std::string& executor, const std::string& scheduler) {
  if (begin_ != takt::TimePoint{} && sum_.duration_s == 0) has_spun();  // it has only spun some
  while (!executors_.empty()) {
    try {
      ends(*executors_.begin()->first);
    } catch (const takt::Error& error) {  // it spins: a callback has called exit
      note(error.what());
    }
  }
  nlohmann::json run = takt::rt::process_json(sum_);
  run.erase("failed");
  if (run.at("trace").empty()) run.erase("trace");
  for (nlohmann::json& callback : run.at("callbacks")) callback.erase("from_outside");
  const takt::rt::Releases releases = takt::rt::releases_of(run);
  run["releases"] = {{"due", releases.due}, {"served", releases.served}};
  run["file"] = program_invocation_name;
  run["executor"] = executor.empty() ? "file" : executor;
  run["scheduler"] = scheduler.empty() ? "file" : scheduler;
  run["composition"] = "file";
  run["transport"] = "auto";
  run["repeat"] = 0;
  run["topics"] = nlohmann::json::array();
  std::ofstream file(path_);
  file << takt::rt::json_text(takt::rt::result_document({std::move(run)}), 2) << '\n';
  file.close();
  if (!file) refuse(path_);
}

bool is_parameter_service(const std::string& node, takt::EntityKind kind, const std::string& name) {
  constexpr std::string_view kNames[] = {"describe_parameters", "get_parameter_types",
                                         "get_parameters",      "list_parameters",
                                         "set_parameters",      "set_parameters_atomically"};
  return kind == takt::EntityKind::service &&
         std::any_of(std::begin(kNames), std::end(kNames),
                     [&](std::string_view each) { return name == node + "/" + std::string(each); });
}

}  // namespace rclcpp::detail
