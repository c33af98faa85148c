// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/chain.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/nodes/node.hpp"

namespace takt {

constinit std::atomic<bool> AbortedInstances::any_{false};
constinit std::array<std::atomic<std::uint64_t>, 1024> AbortedInstances::instances_{};

bool AbortedInstances::finds(std::uint64_t instance) noexcept {
  return instance != 0 && place(instance).load() == instance;
}

Chain::Chain(const ChainOptions& options)
    : options_(options), id_([] {
        static std::atomic<ChainId> last{kNoChain};
        return last.fetch_add(1) + 1;
      }()) {
  if (options.deadline < Nanoseconds::zero()) {
    throw Error(
        fmt::format("chain '{}' has a deadline of {}", options.name, to_string(options.deadline)),
        "leave it out, or give a positive one");
  }
}

ChainStatistics Chain::statistics() const {
  return {.instances = instances_,
          .misses = misses_,
          .aborted = aborted_.load(std::memory_order_relaxed),
          .latency = latency_};
}

std::shared_ptr<Chain> Chain::create(const ChainOptions& options, const std::vector<Step>& path) {
  if (path.empty()) throw Error(fmt::format("chain '{}' has no callbacks", options.name));
  std::vector<std::shared_ptr<Entity>> entities;
  for (const auto& [node, name] : path) {
    const std::shared_ptr<Entity> entity = node->find_entity(name);
    if (std::find(entities.begin(), entities.end(), entity) != entities.end()) {
      throw Error(fmt::format("chain '{}' contains {}/{} twice", options.name,
                              node->fully_qualified_name(), name),
                  "a chain ends where it would begin again");
    }
    if (!entities.empty()) {
      const auto& [before, before_name] = path[entities.size() - 1];
      if (!before->publishes(before_name, entity->topic())) {
        throw Error(fmt::format("chain '{}' does not connect: {}/{} publishes nothing that {}/{} "
                                "receives",
                                options.name, before->fully_qualified_name(), before_name,
                                node->fully_qualified_name(), name),
                    "name the callbacks between, or fix the topics");
      }
    }
    entities.push_back(entity);
  }
  auto chain = std::make_shared<Chain>(options);
  std::uint64_t path_so_far = 0;
  for (std::uint32_t position = 0; position < entities.size(); ++position) {
    path_so_far = extend_path(path_so_far, entities[position]->mark());
    entities[position]->join_chain(
        {chain, position, path_so_far, /*is_last=*/position + 1 == entities.size()});
  }
  return chain;
}

}  // namespace takt
