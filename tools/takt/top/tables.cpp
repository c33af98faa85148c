// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "table.hpp"
#include "top/view.hpp"

namespace takt::tools::top {
namespace {

Cell text(std::string words) {
  return {words.empty() ? "-" : std::move(words)};
}
template <class T>
Cell whole(T number) {
  return {fmt::format("{}", number), static_cast<double>(number)};
}
Cell decimal(double number) {
  return {fmt::format("{:.1f}", number), number, true};
}
Cell us(const std::optional<Nanoseconds>& time) {
  if (!time) return {"-", -1};
  return {microseconds(*time), static_cast<double>(time->count()), true};
}
Cell limit(Nanoseconds time) {
  if (time == Nanoseconds::zero()) return {"-", -1};
  return {microseconds(time), static_cast<double>(time.count())};
}

// "0-3,6".
std::string ranges(const std::vector<std::int32_t>& cpus) {
  std::string text;
  for (std::size_t i = 0; i < cpus.size(); ++i) {
    std::size_t last = i;
    while (last + 1 < cpus.size() && cpus[last + 1] == std::int64_t{cpus[last]} + 1) ++last;
    text += fmt::format("{}{}", i == 0 ? "" : ",", cpus[i]);
    if (last != i) text += fmt::format("-{}", cpus[last]);
    i = last;
  }
  return text;
}

std::string key(std::initializer_list<std::string_view> parts) {
  return fmt::format("{}", fmt::join(parts, " "));
}

bool is_bad(const StatisticsInterval::Faults& faults) {
  return faults.deadline_misses + faults.dropped != 0;
}

Row row_of(const std::string& container, const StatisticsInterval::Thread& thread) {
  const Cell nice{thread.nice == 0 ? "-" : fmt::format("nice {}", thread.nice),
                  -static_cast<double>(thread.nice)};
  return {key({container, std::to_string(thread.tid), thread.name}),
          {text(thread.name), text(container), text(thread.executor), text(thread.policy),
           text(ranges(thread.affinity)), whole(thread.tid),
           thread.priority == 0 ? nice : whole(thread.priority), decimal(thread.cpu_percent),
           decimal(thread.wakeups_per_s), decimal(thread.preemptions_per_s)}};
}

Row row_of(const std::string& container, const StatisticsInterval::Executor& executor) {
  return {key({container, executor.name}),
          {text(executor.name), text(container), text(executor.type), text(executor.scheduler),
           whole(executor.threads), decimal(executor.cpu_percent), decimal(executor.rate),
           whole(executor.pending), whole(executor.all_faults.deadline_misses),
           whole(executor.all_faults.dropped)},
          is_bad(executor.faults)};
}

Row row_of(const std::string& container, const StatisticsInterval::Callback& callback) {
  return {key({container, callback.executor, callback.name(), callback.group, callback.kind}),
          {text(callback.name()), text(container), text(callback.executor),
           whole(callback.priority), decimal(callback.rate), us(callback.latency.p50),
           us(callback.latency.p99), us(callback.latency.max), us(callback.execution.p50),
           us(callback.execution.p99), whole(callback.all_faults.deadline_misses),
           whole(callback.all_faults.dropped), whole(callback.backlog)},
          is_bad(callback.faults)};
}

Row row_of(const std::string& container, const StatisticsInterval::Chain& chain) {
  return {key({container, chain.name}),
          {text(chain.name), text(container), limit(chain.deadline), decimal(chain.rate),
           us(chain.latency.p50), us(chain.latency.p99), us(chain.latency.max),
           whole(chain.all_faults.misses), whole(chain.all_faults.aborted)},
          chain.faults.misses + chain.faults.aborted != 0};
}

Row row_of(const std::string& container, const StatisticsInterval::Topic& topic) {
  return {
      key({container, topic.name}),
      {text(topic.name), text(container), text(topic.type), whole(topic.publishers),
       whole(topic.subscriptions), whole(topic.outside), decimal(topic.rate), whole(topic.dropped)},
      topic.lately_dropped != 0};
}

Row row_of(const std::string& container, const StatisticsInterval::Deviation& deviation) {
  return {key({container, std::to_string(deviation.place)}),
          {text(deviation.text), text(container), text(deviation.id),
           text(fmt::format("{}", fmt::join(deviation.chains, ", "))), whole(deviation.count)},
          deviation.lately != 0};
}

std::string mark_of(Watched::State state) {
  switch (state) {
    case Watched::State::running:
      return "";
    case Watched::State::ended:
    case Watched::State::gone:
      return fmt::format(" ({})", to_string(state));
    case Watched::State::silent:
    case Watched::State::ambiguous:
    case Watched::State::refused:
      break;
  }
  return " (old)";
}

// The first answer of a container is since its start.
void take_interval_away(Row& row) {
  row.is_bad = false;
  for (Cell& cell : row.cells) {
    if (cell.is_of_interval) cell = {"-", -1};
  }
}

template <class Rows>
void add(Table& table, const Watched& container, const Rows& rows) {
  for (const auto& each : rows) {
    Row row = row_of(container.name, each);
    if (container.last.seconds == 0) take_interval_away(row);
    row.is_new = container.is_new && container.last.seconds > 0;
    row.mark = mark_of(container.state);
    table.rows.push_back(std::move(row));
  }
}

// Times are in µs.
std::vector<Table> empty_tables() {
  const Column p99("p99", "latency p99"), max("max", "latency max");
  return {
      {"threads",
       {"thread", "container", "executor", "policy", "CPUs", "tid", "priority", "CPU_%",
        "wakeups/s", "preempted/s"},
       5,
       {}},
      {"executors",
       {"executor", "container", "type", "scheduler", "threads", "CPU_%", "calls/s", "pending",
        "misses", "dropped"},
       4,
       {}},
      {"callbacks",
       {"callback", "container", "executor", Column("prio", "priority"), "calls/s", "latency p50",
        p99, max, "execution p50", Column("p99", "execution p99"), "misses", "dropped", "backlog"},
       3,
       {}},
      {"chains",
       {"chain", "container", "deadline", Column("per s", "instances per s"), "latency p50", p99,
        max, "misses", "aborted"},
       2,
       {}},
      {"topics",
       {"topic", "container", "type", "publishers", "subscriptions", "outside", "messages/s",
        "dropped"},
       3,
       {}},
      {"bounds", {"what was not as assumed", "container", "assumption", "chains", "count"}, 4, {}}};
}

}  // namespace

std::vector<Table> tables_of(const std::vector<Watched>& containers) {
  std::vector<Table> tables = empty_tables();
  for (const Watched& container : containers) {
    add(tables[0], container, container.last.threads);
    add(tables[1], container, container.last.executors);
    add(tables[2], container, container.last.callbacks);
    add(tables[3], container, container.last.chains);
    add(tables[4], container, container.last.topics);
    add(tables[5], container, container.last.deviations);
  }
  return tables;
}

}  // namespace takt::tools::top
