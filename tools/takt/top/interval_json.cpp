// SPDX-License-Identifier: Apache-2.0
#include "top/interval_json.hpp"

#include <chrono>

#include "takt/measuring/row_json.hpp"

namespace takt::tools::top {
namespace {

using nlohmann::json;

json us_or_null(const std::optional<Nanoseconds>& time) {
  return time ? json(static_cast<double>(time->count()) / 1e3) : json();
}

// 0: there is none.
json limit_us(Nanoseconds limit) {
  return limit == Nanoseconds::zero() ? json() : us_or_null(limit);
}

json times_json(const StatisticsInterval::Times& times) {
  return {{"p50", us_or_null(times.p50)},
          {"p99", us_or_null(times.p99)},
          {"max", us_or_null(times.max)}};
}

json thread_json(const StatisticsInterval::Thread& thread) {
  return {{"executor", thread.executor.empty() ? json() : json(thread.executor)},
          {"name", thread.name},
          {"tid", thread.tid},
          {"policy", thread.policy},
          {"priority", thread.priority},
          {"nice", thread.nice},
          {"affinity", thread.affinity},
          {"cpu_percent", thread.cpu_percent},
          {"wakeups_per_s", thread.wakeups_per_s},
          {"preemptions_per_s", thread.preemptions_per_s}};
}

json executor_json(const StatisticsInterval::Executor& executor) {
  json row{{"executor", executor.name},           {"type", executor.type},
           {"scheduler", executor.scheduler},     {"threads", executor.threads},
           {"cpu_percent", executor.cpu_percent}, {"rate_hz", executor.rate},
           {"pending", executor.pending}};
  row.update(rt::row_json(executor.faults));
  return row;
}

json callback_json(const StatisticsInterval::Callback& callback) {
  json row{{"executor", callback.executor},
           {"node", callback.node},
           {"group", callback.group},
           {"callback", callback.callback},
           {"kind", callback.kind},
           {"topic", callback.topic.empty() ? json() : json(callback.topic)},
           {"priority", callback.priority},
           {"deadline_us", limit_us(callback.deadline)},
           {"budget_us", limit_us(callback.budget)},
           {"rate_hz", callback.rate},
           {"latency_us", times_json(callback.latency)},
           {"execution_us", times_json(callback.execution)},
           {"backlog", callback.backlog},
           {"since_start", rt::row_json(callback.all_faults)}};
  row.update(rt::row_json(callback.faults));
  return row;
}

json chain_json(const StatisticsInterval::Chain& chain) {
  json row{{"name", chain.name},
           {"deadline_us", limit_us(chain.deadline)},
           {"rate_hz", chain.rate},
           {"latency_us", times_json(chain.latency)},
           {"since_start", rt::row_json(chain.all_faults)}};
  row.update(rt::row_json(chain.faults));
  return row;
}

json topic_json(const StatisticsInterval::Topic& topic) {
  return {{"topic", topic.name},
          {"type", topic.type.empty() ? json() : json(topic.type)},
          {"publishers", topic.publishers},
          {"subscriptions", topic.subscriptions},
          {"matched_outside", topic.outside},
          {"rate_hz", topic.rate},
          {"dropped", topic.lately_dropped}};
}

json deviation_json(const StatisticsInterval::Deviation& deviation) {
  return {{"id", deviation.id},
          {"text", deviation.text},
          {"chains", deviation.chains},
          {"count", deviation.lately},
          {"since_start", {{"count", deviation.count}}}};
}

// The first answer of a container is since its start.
void take_interval_away(json& row) {
  for (const char* key : {"cpu_percent", "wakeups_per_s", "preemptions_per_s", "rate_hz",
                          "deadline_misses", "overruns", "misses", "aborted", "dropped", "count"}) {
    if (row.contains(key)) row[key] = json();
  }
  for (const char* key : {"latency_us", "execution_us"}) {
    if (row.contains(key)) row[key] = times_json({});
  }
}

template <class Rows, class Make>
json list_of(const StatisticsInterval& last, const Rows& rows, Make make) {
  json list = json::array();
  for (const auto& each : rows) {
    json row = make(each);
    if (last.seconds == 0) take_interval_away(row);
    list.push_back(std::move(row));
  }
  return list;
}

}  // namespace

json interval_json(const std::vector<Watched>& containers) {
  json list = json::array();
  for (const Watched& container : containers) {
    json row{{"name", container.name},
             {"state", to_string(container.state)},
             {"pid", container.pid == 0 ? json() : json(container.pid)}};
    if (container.is_new) {
      const StatisticsInterval& last = container.last;
      const bool has_interval = last.seconds > 0;
      row["interval_s"] = has_interval ? json(last.seconds) : json();
      row["cpu_percent"] = has_interval ? json(last.cpu_percent) : json();
      row["threads"] = list_of(last, last.threads, thread_json);
      row["executors"] = list_of(last, last.executors, executor_json);
      row["callbacks"] = list_of(last, last.callbacks, callback_json);
      row["chains"] = list_of(last, last.chains, chain_json);
      row["topics"] = list_of(last, last.topics, topic_json);
      row["deviations"] =
          last.watches_bounds ? list_of(last, last.deviations, deviation_json) : json();
    }
    list.push_back(std::move(row));
  }
  const std::chrono::duration<double> time = std::chrono::system_clock::now().time_since_epoch();
  return {{"time", time.count()}, {"containers", std::move(list)}};
}

}  // namespace takt::tools::top
