// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_chains(const Value& value) {
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

void ConfigurationReader::read_chain(const Value& value) {
  ChainDescription chain;
  std::set<std::pair<std::string, std::string>> steps;
  chain.where = errors_.where(value.line);
  read_map(
      value, "a chain",
      {{"name",
        "Also of the executor and thread that Takt assigns; entries of that name in `executors` "
        "and `threads` take their place.",
        into_node_name(chain.options.name), true},
       {"priority", "Larger is more critical.", into(chain.options.priority)},
       {"deadline", "Not 0. From end to end.",
        into_duration(chain.options.deadline,
                      [&] {
                        if (chain.options.deadline == Nanoseconds::zero()) {
                          throw Error("a deadline of 0 cannot be met",
                                      "leave it out, or give it time");
                        }
                      })},
       {"path",
        "`node/callback`. Steps may be left out where there is only one way between two that "
        "are named. A topic's first slash may be left out.",
        each_in_list([&](const Value& step) { read_step(step, chain, steps); }), true}});
  const auto is_namesake = [&](const ChainDescription& other) {
    return other.options.name == chain.options.name;
  };
  if (std::any_of(system_.chains.begin(), system_.chains.end(), is_namesake)) {
    errors_.add(value.line, fmt::format("two chains are called '{}'", chain.options.name),
                "give each its own name");
  }
  if (const Value* path = document::find(value, "path"); document::is_empty_list(path)) {
    errors_.add(path->line, fmt::format("the path of chain '{}' is empty", chain.options.name),
                "list the callbacks that it goes through");
  }
  if (!chain.path.empty()) system_.chains.push_back(std::move(chain));
}

// "node/callback". A callback may be called by a topic with slashes, and a node has a namespace.
void ConfigurationReader::read_step(const Value& value, ChainDescription& chain,
                                    std::set<std::pair<std::string, std::string>>& steps) {
  std::string text;
  into(text)(value);
  if (text.empty()) return;
  const std::string full = text.starts_with('/') ? text : "/" + text;
  for (const std::string& name : component_names()) {
    if (full.size() <= name.size() + 1 || full[name.size()] != '/' || !full.starts_with(name)) {
      continue;
    }
    std::pair<std::string, std::string> step{name, full.substr(name.size() + 1)};
    if (!steps.insert(step).second) {
      errors_.add(value.line, fmt::format("the chain comes to '{}' twice", text),
                  "a chain ends where it would begin again");
    }
    chain.path.push_back(std::move(step));
    return;
  }
  std::vector<std::string> nodes;
  for (const std::string& name : component_names()) nodes.push_back(name.substr(1));
  errors_.add(value.line, fmt::format("'{}' is no callback of a component of this file", text),
              fmt::format("write node/callback; the nodes are {}", fmt::join(nodes, ", ")));
}

}  // namespace takt
