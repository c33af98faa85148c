// The statistics of a running container.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include <unistd.h>

#include "takt/containers/component_list.hpp"
#include "takt/containers/container_watching.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/containers/running_trace.hpp"
#include "takt/nodes/callback_info.hpp"

namespace takt {
namespace {

using Response = GetStatistics::Response;

std::vector<GetStatistics::Thread> threads_now(const std::map<int, std::string>& executor_of) {
  std::vector<GetStatistics::Thread> threads;
  std::error_code ended;
  for (std::filesystem::directory_iterator task("/proc/self/task", ended), end; task != end;
       task.increment(ended)) {
    const int tid = std::atoi(task->path().filename().c_str());
    const auto used = thread_usage(tid);
    if (!used) continue;  // it has ended
    const ThreadState state = thread_state(tid);
    const auto executor = executor_of.find(tid);
    threads.push_back({.executor = executor != executor_of.end() ? executor->second : "",
                       .name = state.name,
                       .tid = tid,
                       .policy = std::string(to_string(state.policy)),
                       .priority = state.priority,
                       .nice = state.nice,
                       .affinity = {state.affinity.begin(), state.affinity.end()},
                       .cpu_time_ns = used->cpu_time.count(),
                       .wakeups = used->voluntary_switches,
                       .preemptions = used->involuntary_switches});
  }
  return threads;
}

GetStatistics::Callback row_of(const std::string& executor, const CallbackStatistics& counted) {
  return {.executor = executor,
          .node = counted.node,
          .group = counted.group,
          .callback = counted.callback,
          .kind = std::string(to_string(counted.kind)),
          .topic = counted.topic,
          .received = counted.received,
          .expected = counted.expected,
          .dropped = counted.dropped,
          .deadline_misses = counted.deadline_misses,
          .overruns = counted.overruns,
          .latency = GetStatistics::Times::of(counted.latency),
          .execution = GetStatistics::Times::of(counted.execution)};
}

// Messages inside the process are counted where they arrive, others by DDS.
std::vector<GetStatistics::Topic> topics_of(const Response& response,
                                            const std::vector<EndpointState>& endpoints) {
  std::map<std::string, GetStatistics::Topic> topics;
  for (const GetStatistics::Callback& callback : response.callbacks) {
    if (callback.kind != to_string(EntityKind::subscription)) continue;
    GetStatistics::Topic& topic = topics[callback.topic];
    ++topic.subscriptions;
    topic.messages = std::max(topic.messages, callback.expected);
    topic.dropped += callback.dropped;
  }
  for (const EndpointState& endpoint : endpoints) {
    if (!endpoint.topic.starts_with('/')) continue;  // an endpoint of a service
    GetStatistics::Topic& topic = topics[endpoint.topic];
    topic.type = endpoint.type;
    topic.publishers += endpoint.is_writer ? 1 : 0;
    topic.outside = std::max(topic.outside, static_cast<std::uint32_t>(endpoint.matched));
    topic.messages = std::max(topic.messages, endpoint.messages);
  }
  std::vector<GetStatistics::Topic> rows;
  for (auto& [name, topic] : topics) {
    topic.name = name;
    rows.push_back(std::move(topic));
  }
  return rows;
}

// Adds the parameters in force, which may change at run time. Leaves out removed callbacks, which
// executors keep only for their results.
void complete_living(const ComponentList& components,
                     std::vector<GetStatistics::Callback>& callbacks) {
  std::multimap<std::pair<std::string, std::string>, std::size_t> rows;
  for (std::size_t i = 0; i < callbacks.size(); ++i)
    rows.emplace(std::pair{callbacks[i].node, callbacks[i].callback}, i);
  std::vector<GetStatistics::Callback> living;
  for (const auto& loaded : components.all()) {
    const Node& node = *loaded->node();
    for (const auto& entity : node.entities()) {
      const auto row = rows.find({node.fully_qualified_name(), entity->name()});
      if (row == rows.end()) continue;
      const CallbackInfo info = callback_info(node, *entity);
      living.push_back(std::move(callbacks[row->second]));
      living.back().priority = info.priority;
      living.back().deadline_ns = info.deadline.count();
      living.back().budget_ns = info.budget.count();
      rows.erase(row);
    }
  }
  callbacks = std::move(living);
}

}  // namespace

GetStatistics::Response Container::statistics() const {
  Response now{.pid = getpid(),
               .time_ns = Clock::steady().now().time_since_epoch().count(),
               .cpu_time_ns = process_cpu_time().count()};
  std::map<int, std::string> executor_of;
  for (const auto& running : *running_) {
    if (!running->has_begun.load()) continue;
    for (const int tid : running->executor->running_threads()) executor_of[tid] = running->name;
    if (running->is_own) continue;
    const ExecutorDescription& made = running->description;
    now.executors.push_back({.name = running->name,
                             .type = made.type,
                             .scheduler = scheduler_of(made),
                             .pending = running->executor->pending()});
    for (const CallbackStatistics& counted : running->executor->statistics()) {
      now.callbacks.push_back(row_of(running->name, counted));
    }
  }
  now.threads = threads_now(executor_of);
  complete_living(*components_, now.callbacks);
  for (const auto& chain : chains_) {
    const ChainStatistics counted = chain->statistics();
    now.chains.push_back({.name = chain->options().name,
                          .deadline_ns = chain->options().deadline.count(),
                          .instances = counted.instances,
                          .misses = counted.misses,
                          .aborted = counted.aborted,
                          .latency = GetStatistics::Times::of(counted.latency)});
  }
  now.topics = topics_of(now, endpoints());
  watch_->add_to(now);
  return now;
}

TraceContainer::Response Container::trace(const TraceContainer::Request& request) {
  TraceContainer::Response answer = trace_->serve(request);
  if (request.command != "stop" || !answer.success) return answer;
  for (const ProcessResult::ModeSwitch& each : setting_->modes->switches()) {
    if (each.end_ns < answer.begin_ns || each.begin_ns > answer.end_ns) continue;
    answer.modes.push_back({each.mode, each.cause, each.begin_ns, each.end_ns});
  }
  return answer;
}

}  // namespace takt
