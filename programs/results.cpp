// SPDX-License-Identifier: Apache-2.0
#include "takt/programs/results.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/executors/figures.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/run.hpp"
#include "takt/nodes/node.hpp"

namespace takt::programs {
namespace {

/// What is wrong with the file, and which variable names it.
template <class Function>
void naming_variable(Function function) {
  try {
    function();
  } catch (const std::exception& error) {
    throw Error(std::string("TAKT_RESULTS=") + error.what());
  }
}

std::uintmax_t size_of(const std::string& path) {
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);
  return none ? 0 : size;
}

/// Adds it to the row with its key, or as a new one.
template <class Rows, class Row, class Key>
Row& add_to(Rows& rows, const Row& more, const Key& key) {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return key(row) == key(more); });
  if (found == rows.end()) return rows.emplace_back(more);
  merge(found->statistics, more.statistics);
  return *found;
}

void keep_last_events(ThreadStatistics& thread, std::size_t most) {
  const std::size_t surplus = thread.trace.size() - std::min(thread.trace.size(), most);
  thread.trace.erase(thread.trace.begin(),
                     thread.trace.begin() + static_cast<std::ptrdiff_t>(surplus));
  thread.trace_overwritten += surplus;
}

}  // namespace

Results::Results(const std::string& path, std::size_t trace_events)
    : path_(std::filesystem::absolute(path)),  // the program may change its folder
      trace_events_(trace_events),
      size_before_(size_of(path_)) {
  std::error_code none;
  const auto status = std::filesystem::status(path_, none);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw Error("this is not a regular file", "choose another one", "TAKT_RESULTS=" + path_);
  }
  naming_variable([&] { OutputFile::check(path_); });
  sum_.name = program_invocation_short_name;
  sum_.allocations_counted = allocations_are_counted();
}

void Results::spins() {
  if (begin_ != TimePoint{}) return;
  begin_ = Clock::steady().now();
  cpu_time_before_ = process_cpu_time();
}

void Results::has_spun(bool is_long) {
  if (begin_ == TimePoint{}) return;
  const auto seconds = [](Nanoseconds time) { return std::chrono::duration<double>(time).count(); };
  sum_.duration_s = seconds(Clock::steady().now() - begin_);
  sum_.cpu_percent = 100 * seconds(process_cpu_time() - cpu_time_before_) / sum_.duration_s;
  if (is_long || sum_.pss_kb == 0) sum_.pss_kb = proportional_set_size_kb();
}

void Results::made(const Executor& executor, const std::string& type,
                   const std::string& scheduler) {
  executors_[&executor] = {type,
                           scheduler.empty() ? executors().traits(type).scheduler : scheduler};
}

void Results::added(const std::shared_ptr<Node>& node) {
  std::erase_if(nodes_,
                [&](const auto& known) { return known.expired() || is_same_owner(known, node); });
  nodes_.push_back(node);
}

void Results::ends(const Executor& executor) {
  const auto kind = executors_.extract(&executor);
  if (kind.empty()) return;  // it has been asked at exit
  ProcessResult part;
  for (CallbackStatistics& callback : executor.statistics()) {
    part.callbacks.push_back({kind.mapped().executor, std::move(callback)});
  }
  if (part.callbacks.empty()) return;
  part.executors.push_back(
      {kind.mapped().executor, kind.mapped().executor, kind.mapped().scheduler});
  for (ThreadStatistics& thread : executor.thread_statistics()) {
    if (!thread.in_force.refused.empty()) part.notes.push_back(thread.in_force.refused);
    part.allocations_while_spinning += thread.counters.allocations;
    part.allocations_in_dds += thread.counters.foreign_allocations;
    part.threads.push_back({kind.mapped().executor, std::move(thread), kind.mapped().executor,
                            kind.mapped().scheduler});
  }
  add(part);
}

void Results::add(const ProcessResult& part) {
  sum_.allocations_while_spinning += part.allocations_while_spinning;
  sum_.allocations_in_dds += part.allocations_in_dds;
  for (ProcessResult::Callback more : part.callbacks) {
    CallbackStatistics& of = more.statistics;
    if (is_parameter_service(of.node, of.kind, of.callback)) continue;
    if (of.kind != EntityKind::timer) of.expected -= std::min(of.expected, waiting(of));
    add_to(sum_.callbacks, more, [](const auto& callback) {
      const CallbackStatistics& name = callback.statistics;
      return std::tie(callback.executor, name.node, name.group, name.callback, name.kind);
    });
  }
  for (const ProcessResult::UsedExecutor& more : part.executors) {
    const bool is_known = std::any_of(sum_.executors.begin(), sum_.executors.end(),
                                      [&](const auto& known) { return known.name == more.name; });
    if (!is_known) sum_.executors.push_back(more);
  }
  for (const ProcessResult::Thread& more : part.threads) {
    if (more.statistics.in_force.tid == 0) continue;  // its executor has only spun some
    auto& row = add_to(sum_.threads, more, [](const auto& thread) {
      return std::tie(thread.executor, thread.statistics.in_force.tid);
    });
    keep_last_events(row.statistics, trace_events_);
  }
  for (const ProcessResult::ChainResult& more : part.chains) {
    add_to(sum_.chains, more, [](const auto& chain) { return std::tie(chain.name); });
  }
  for (const std::string& text : part.notes) note(text);
}

// A program does not wait until all is served, and another executor may continue with it.
std::uint64_t Results::waiting(const CallbackStatistics& of) const {
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (node == nullptr || node->fully_qualified_name() != of.node) continue;
    for (const auto& entity : node->entities()) {
      if (entity->kind() == of.kind && entity->name() == of.callback) return entity->ready_count();
    }
  }
  return 0;
}

void Results::note_spinning(const std::string& executor) {
  note("an executor '" + executor +
       "' still spun when the program ended: what it served is not in the results; let spin() "
       "return before exit()");
}

void Results::note(const std::string& text) {
  if (std::find(sum_.notes.begin(), sum_.notes.end(), text) == sum_.notes.end()) {
    sum_.notes.push_back(text);
  }
}

void Results::write(const std::string& executor, const std::string& placement,
                    const std::string& scheduler) {
  if (sum_.duration_s == 0) has_spun(true);  // a callback has called exit
  while (!executors_.empty()) {
    const Kind kind = executors_.begin()->second;
    try {
      ends(*executors_.begin()->first);
    } catch (const Error&) {
      note_spinning(kind.executor);
    }
  }
  if (size_of(path_) != size_before_) {
    note("another process has written its results to the same file; these are of the last one");
  }
  rt::Run run = rt::run_of(sum_);
  run.file = program_invocation_name;
  if (!executor.empty()) run.executor = executor;
  if (!placement.empty()) run.placement = placement;
  if (!scheduler.empty()) run.scheduler = scheduler;
  const nlohmann::json document = rt::result_document({run});
  naming_variable(
      [&] { write_output(path_, std::string(kTaktsJson) + rt::json_text(document, 2) + '\n'); });
}

bool is_parameter_service(const std::string& node, EntityKind kind, const std::string& name) {
  constexpr std::string_view kNames[] = {"describe_parameters", "get_parameter_types",
                                         "get_parameters",      "list_parameters",
                                         "set_parameters",      "set_parameters_atomically"};
  return kind == EntityKind::service &&
         std::any_of(std::begin(kNames), std::end(kNames),
                     [&](std::string_view each) { return name == node + "/" + std::string(each); });
}

}  // namespace takt::programs
