// SPDX-License-Identifier: Apache-2.0
#include "run/deliveries.hpp"

#include <algorithm>

namespace takt::tools {
namespace {

using ProcessEndpoint = ProcessState::Endpoint;

/// Calls `pair(process of the writer, its index, process of the reader, its index)` for each writer
/// and reader of the same DDS topic.
template <class Pair>
void for_each_pair(const std::vector<ProcessState>& processes, Pair&& pair) {
  for (std::size_t from = 0; from < processes.size(); ++from) {
    const std::vector<ProcessEndpoint>& writers = processes[from].endpoints;
    for (std::size_t j = 0; j < writers.size(); ++j) {
      const ProcessEndpoint& writer = writers[j];
      if (!writer.is_writer) continue;
      for (std::size_t to = 0; to < processes.size(); ++to) {
        // Count messages within a process if they also use DDS.
        if (to == from && !processes[from].serves_itself) continue;
        const std::vector<ProcessEndpoint>& readers = processes[to].endpoints;
        for (std::size_t i = 0; i < readers.size(); ++i) {
          const ProcessEndpoint& reader = readers[i];
          if (!reader.is_writer && reader.topic == writer.topic && reader.type == writer.type &&
              (writer.is_reliable || !reader.is_reliable)) {
            pair(from, j, to, i);
          }
        }
      }
    }
  }
}

std::vector<std::vector<std::uint64_t>> zeros(const std::vector<ProcessState>& processes) {
  std::vector<std::vector<std::uint64_t>> counts;
  for (const ProcessState& process : processes) counts.emplace_back(process.endpoints.size(), 0);
  return counts;
}

}  // namespace

std::vector<std::vector<std::uint64_t>> count_matches(const std::vector<ProcessState>& processes) {
  auto wanted = zeros(processes);
  for_each_pair(processes, [&](std::size_t from, std::size_t j, std::size_t to, std::size_t i) {
    ++wanted[to][i];
    ++wanted[from][j];
  });
  return wanted;
}

std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<ProcessState>& processes) {
  auto sent = zeros(processes);
  for_each_pair(processes, [&](std::size_t from, std::size_t j, std::size_t to, std::size_t i) {
    sent[to][i] += processes[from].endpoints[j].messages;
  });
  return sent;
}

Ends ends_of(const std::vector<ProcessState>& processes) {
  Ends ends;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    for (const ProcessEndpoint& endpoint : processes[process].endpoints) {
      ends[endpoint.topic].emplace(process, endpoint.id);
    }
  }
  return ends;
}

bool all_is_served(const std::vector<ProcessState>& processes, const Countable& is_countable) {
  const auto sent = count_sent(processes);
  const Ends ends = ends_of(processes);
  for (std::size_t process = 0; process < processes.size(); ++process) {
    if (processes[process].pending != 0) return false;
    const std::vector<ProcessEndpoint>& endpoints = processes[process].endpoints;
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (!endpoints[i].is_writer && endpoints[i].is_reliable &&
          endpoints[i].messages < sent[process][i] && is_countable(ends, endpoints[i].topic)) {
        return false;
      }
    }
  }
  return true;
}

void complete_callbacks(std::vector<rt::Run::Callback>& callbacks,
                        const std::vector<ProcessEndpoint>& endpoints,
                        const std::vector<std::uint64_t>& sent, const Ends& ends,
                        const Countable& is_countable) {
  std::vector<bool> used(endpoints.size(), false);
  for (rt::Run::Callback& callback : callbacks) {
    CallbackStatistics& counted = callback.statistics;
    if (counted.kind != EntityKind::subscription) continue;
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (used[i] || endpoints[i].is_writer || endpoints[i].topic != counted.topic) continue;
      used[i] = true;
      if (is_countable(ends, endpoints[i].topic)) {
        counted.expected = counted.expected - counted.from_outside + sent[i];
      }
      break;
    }
  }
}

bool uses_shared_memory(const std::vector<ProcessState>& processes) {
  return std::any_of(processes.begin(), processes.end(), [](const ProcessState& process) {
    return std::any_of(
        process.endpoints.begin(), process.endpoints.end(),
        [](const ProcessEndpoint& endpoint) { return endpoint.transport == "shared memory"; });
  });
}

}  // namespace takt::tools
