// SPDX-License-Identifier: Apache-2.0
#include "run/deliveries.hpp"

#include <algorithm>

namespace takt::tools {
namespace {

using nlohmann::json;

/// Calls `pair(writer, reader, process of the reader)` for each writer and reader of the same DDS
/// topic.
template <class Pair>
void for_each_pair(const std::vector<json>& processes, Pair&& pair) {
  for (std::size_t from = 0; from < processes.size(); ++from) {
    for (const json& writer : processes[from].at("endpoints")) {
      if (!writer.at("is_writer")) continue;
      for (std::size_t to = 0; to < processes.size(); ++to) {
        // Count messages within a process if they also use DDS.
        if (to == from && !processes[from].at("serves_itself")) continue;
        const json& readers = processes[to].at("endpoints");
        for (std::size_t i = 0; i < readers.size(); ++i) {
          const json& reader = readers[i];
          if (!reader.at("is_writer") && reader.at("topic") == writer.at("topic") &&
              reader.at("type") == writer.at("type") &&
              (writer.at("is_reliable") || !reader.at("is_reliable"))) {
            pair(from, writer, to, i);
          }
        }
      }
    }
  }
}

}  // namespace

std::vector<json> count_matches(const std::vector<json>& processes) {
  std::vector<json> wanted;
  for (const json& process : processes) {
    wanted.push_back(std::vector<int>(process.at("endpoints").size(), 0));
  }
  const auto add_one = [](json& count) { count = count.get<int>() + 1; };
  for_each_pair(processes,
                [&](std::size_t from, const json& writer, std::size_t to, std::size_t i) {
                  add_one(wanted[to][i]);
                  const json& endpoints = processes[from].at("endpoints");
                  for (std::size_t j = 0; j < endpoints.size(); ++j) {
                    if (&endpoints[j] == &writer) add_one(wanted[from][j]);
                  }
                });
  return wanted;
}

std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<json>& processes) {
  std::vector<std::vector<std::uint64_t>> sent;
  for (const json& process : processes) sent.emplace_back(process.at("endpoints").size(), 0);
  for_each_pair(processes, [&](std::size_t, const json& writer, std::size_t to, std::size_t i) {
    sent[to][i] += writer.at("messages").get<std::uint64_t>();
  });
  return sent;
}

Ends ends_of(const std::vector<json>& processes) {
  Ends ends;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    for (const json& endpoint : processes[process].at("endpoints")) {
      ends[endpoint.at("topic")].emplace(process, endpoint.at("id").get<std::uint64_t>());
    }
  }
  return ends;
}

bool all_is_served(const std::vector<json>& processes, const Countable& is_countable) {
  const auto sent = count_sent(processes);
  const Ends ends = ends_of(processes);
  for (std::size_t process = 0; process < processes.size(); ++process) {
    if (processes[process].at("pending") != 0) return false;
    const json& endpoints = processes[process].at("endpoints");
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (!endpoints[i].at("is_writer") && endpoints[i].at("is_reliable") &&
          endpoints[i].at("messages").get<std::uint64_t>() < sent[process][i] &&
          is_countable(ends, endpoints[i].at("topic"))) {
        return false;
      }
    }
  }
  return true;
}

void complete_callbacks(json& callbacks, const json& endpoints,
                        const std::vector<std::uint64_t>& sent, const Ends& ends,
                        const Countable& is_countable) {
  std::vector<bool> used(endpoints.size(), false);
  for (json& callback : callbacks) {
    if (callback.at("kind") != "subscription") continue;
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (used[i] || endpoints[i].at("is_writer") ||
          endpoints[i].at("topic") != callback.at("topic")) {
        continue;
      }
      used[i] = true;
      if (!is_countable(ends, endpoints[i].at("topic"))) break;
      const auto number = [&](const char* key) { return callback.at(key).get<std::uint64_t>(); };
      const std::uint64_t expected = number("expected") - number("from_outside") + sent[i];
      const std::uint64_t served = number("received") + number("dropped");
      callback["expected"] = expected;
      callback["lost"] = expected > served ? expected - served : 0;
      break;
    }
  }
}

bool uses_shared_memory(const std::vector<json>& processes) {
  return std::any_of(processes.begin(), processes.end(), [](const json& process) {
    const json& endpoints = process.at("endpoints");
    return std::any_of(endpoints.begin(), endpoints.end(), [](const json& endpoint) {
      return endpoint.at("transport") == "shared memory";
    });
  });
}

}  // namespace takt::tools
