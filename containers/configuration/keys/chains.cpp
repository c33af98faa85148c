// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void ChainReader::read(const Value& value) {
  if (describes("`auto`")) {
    return each_in_list([this](const Value& chain) { read_chain(chain); })(value);
  }
  system_.chains_where = errors_.where(value.line);
  const auto* word = std::get_if<std::string>(&value.content);
  if (word != nullptr && *word == "auto") {
    system_.finds_chains = true;
    return;
  }
  if (!std::holds_alternative<document::List>(value.content)) {
    return refuse(value, "a list of chains, or auto");
  }
  each_in_list([this](const Value& chain) { read_chain(chain); })(value);
}

void ChainReader::read_chain(const Value& value) {
  ChainDescription chain;
  std::set<std::pair<std::string, std::string>> steps;
  chain.where = errors_.where(value.line);
  read_map(
      value, "a chain",
      {{"name",
        "Also the name of the executor and the thread that Takt assigns to the chain. An entry "
        "with this name in `executors` or `threads` replaces the assigned one.",
        into_node_name(chain.options.name), true},
       {"priority", "Larger is more critical.", into(chain.options.priority)},
       {"deadline", "Longest permitted end-to-end latency. Not 0.",
        into_duration(chain.options.deadline,
                      [&] {
                        if (chain.options.deadline == Nanoseconds::zero()) {
                          throw Error("a deadline of 0 cannot be met",
                                      "remove it, or write a longer time");
                        }
                      })},
       {"concurrency",
        "How many of its callbacks a pool (`events`, `multi_threaded`) runs at the same time, "
        "counted in each executor; others wait, and let other chains go first. By default any "
        "number.",
        [&](const Value& limit) {
          int most = 0;
          into(most, 1)(limit);
          chain.options.concurrency = static_cast<std::uint32_t>(most);
        }},
       {"losses",
        "Whether messages on its way may be overwritten, and releases missed: `refused`, or "
        "`allowed`. `takt analyze` then says how many instances its guarantee covers.",
        into(chain.allows_losses, {{"refused", false}, {"allowed", true}})},
       {"from",
        "Which instances `takt analyze` speaks of: `start`, all, or `activation`, those that begin "
        "when all components are up and what they send at the start has been served.",
        into(chain.from_activation, {{"start", false}, {"activation", true}})},
       {"accept", "As that of the file, for this chain.", into_accepted(chain.accepted)},
       {"path",
        "Its callbacks, as `node/callback`. You can omit steps between two callbacks if only one "
        "path connects them, and the first slash of a topic.",
        each_in_list([&](const Value& step) { read_step(step, chain, steps); }), true}});
  const auto is_namesake = [&](const ChainDescription& other) {
    return other.options.name == chain.options.name;
  };
  if (std::any_of(system_.chains.begin(), system_.chains.end(), is_namesake)) {
    errors_.add(value.line, fmt::format("two chains have the name '{}'", chain.options.name),
                "rename one of them");
  }
  if (const Value* path = document::find(value, "path"); document::is_empty_list(path)) {
    errors_.add(path->line, fmt::format("the path of chain '{}' is empty", chain.options.name),
                "list its callbacks");
  }
  if (!chain.path.empty()) system_.chains.push_back(std::move(chain));
}

// "node/callback". Namespaces and topics contain slashes, too: so compare with the node names.
void ChainReader::read_step(const Value& value, ChainDescription& chain,
                            std::set<std::pair<std::string, std::string>>& steps) {
  std::string text;
  into(text)(value);
  if (text.empty()) return;
  const std::string full = text.starts_with('/') ? text : "/" + text;
  for (const std::string& name : file_.component_names) {
    if (full.size() <= name.size() + 1 || full[name.size()] != '/' || !full.starts_with(name)) {
      continue;
    }
    std::pair<std::string, std::string> step{name, full.substr(name.size() + 1)};
    if (!steps.insert(step).second) {
      errors_.add(value.line, fmt::format("the chain contains '{}' twice", text),
                  "end the chain before the second one");
    }
    chain.path.push_back(std::move(step));
    return;
  }
  std::vector<std::string> nodes;
  for (const std::string& name : file_.component_names) nodes.push_back(name.substr(1));
  errors_.add(value.line, fmt::format("'{}' names no component of this file", text),
              fmt::format("write node/callback; the nodes are {}", fmt::join(nodes, ", ")));
}

}  // namespace takt
