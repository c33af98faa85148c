// takt plan: shows the priorities, executors and CPUs that Takt derives from the chains of a file.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/container.hpp"
#include "takt/containers/structure.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/constructor_exit.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::plan_command {
namespace {

using nlohmann::json;

json plan_json(const std::string& process, const Container& container) {
  const Plan& plan = container.plan();
  json chains = json::array(), callbacks = json::array(), executors = json::array();
  for (const PlannedChain& chain : plan.chains) {
    std::vector<std::string> path;
    for (const Chain::Step& step : chain.path) path.push_back(to_string(step));
    chains.push_back({{"name", chain.options.name},
                      {"priority", chain.options.priority},
                      {"deadline_us", rt::us(chain.options.deadline)},
                      {"path", std::move(path)}});
  }
  for (const Plan::Callback& callback : plan.callbacks) {
    const CallbackParameters parameters = callback.node->callback_parameters(*callback.entity);
    callbacks.push_back(
        {{"node", callback.node->fully_qualified_name()},
         {"callback", callback.entity->name()},
         {"group", callback.entity->group()->name()},
         {"chain", callback.chain},
         {"priority", parameters.priority.value_or(0)},
         {"period_us", rt::us(callback.period)},
         {"budget_us", rt::us(parameters.budget.value_or(Nanoseconds::zero()))},
         {"executor", container.executor_of(*callback.node, *callback.entity->group())}});
  }
  const std::vector<ContainerStructure::Executor> made = structure_of(container).executors;
  for (const ExecutorDescription& executor : container.description().executors) {
    json threads = json::array();
    const auto found = std::find_if(made.begin(), made.end(),
                                    [&](const auto& each) { return each.name == executor.name; });
    if (found == made.end()) continue;  // it serves nobody
    for (const ContainerStructure::Thread& thread : found->threads) {
      threads.push_back({{"name", thread.name},
                         {"policy", thread.policy},
                         {"priority", thread.priority},
                         {"affinity", thread.cpus}});
    }
    executors.push_back({{"name", executor.name},
                         {"type", executor.type},
                         {"assigned", executor.where.empty()},
                         {"utilisation", container.utilisation_of(executor.name)},
                         {"threads", std::move(threads)}});
  }
  return {{"process", process},
          {"chains", std::move(chains)},
          {"callbacks", std::move(callbacks)},
          {"executors", std::move(executors)}};
}

void print(const json& plan) {
  const auto time = [](const json& us_value) {
    const double us = us_value.get<double>();
    return us == 0 ? std::string("-") : fmt::format("{}", us / 1000);
  };
  Table chains({"chain", "priority", "deadline_ms", "path"});
  for (const json& chain : plan.at("chains")) {
    chains.add(
        {chain.at("name"), std::to_string(chain.at("priority").get<int>()),
         time(chain.at("deadline_us")),
         fmt::format("{}", fmt::join(chain.at("path").get<std::vector<std::string>>(), " → "))});
  }
  chains.print("chains");
  Table callbacks(
      {"node", "callback", "group", "chain", "priority", "period_ms", "budget_ms", "executor"});
  for (const json& callback : plan.at("callbacks")) {
    const std::string chain = callback.at("chain");
    callbacks.add({callback.at("node"), callback.at("callback"), callback.at("group"),
                   chain.empty() ? "-" : chain, std::to_string(callback.at("priority").get<int>()),
                   time(callback.at("period_us")), time(callback.at("budget_us")),
                   callback.at("executor")});
  }
  callbacks.print("callbacks (a larger priority is more urgent)");
  Table executors({"executor", "type", "by", "used_%", "thread", "policy", "priority", "cpus"});
  for (const json& executor : plan.at("executors")) {
    const double used = 100 * executor.at("utilisation").get<double>();
    std::vector<std::string> row{executor.at("name"), executor.at("type"),
                                 executor.at("assigned").get<bool>() ? "Takt" : "the file",
                                 used == 0 ? "-" : fmt::format("{:.1f}", used)};
    if (executor.at("threads").empty()) {
      row.insert(row.end(), {"-", "-", "-", "-"});
      executors.add(row);
    }
    for (const json& thread : executor.at("threads")) {
      std::vector<std::string> cells = row;
      const auto cpus = thread.at("affinity").get<std::vector<int>>();
      cells.insert(cells.end(), {thread.at("name"), thread.at("policy"),
                                 std::to_string(thread.at("priority").get<int>()),
                                 cpus.empty() ? "all" : fmt::format("{}", fmt::join(cpus, ","))});
      executors.add(std::move(cells));
    }
  }
  executors.print("executors (used: share of a CPU, by callbacks with a budget and a period)");
}

struct Options {
  std::string file, as, method, json;
};

void plan(const Options& options) {
  const std::string &file = options.file, &json_path = options.json;
  SystemDescription system = read_system_as(file, options.as);
  if (!options.method.empty())
    system.priorities =
        options.method == "picas" ? PriorityMethod::picas : PriorityMethod::rate_monotonic;
  const std::vector<SystemDescription> processes = split(system, Composition::file);
  json plans = json::array();
  for (SystemDescription process : processes) {
    process.dds.reset();           // nothing runs
    process.machine.cpus.clear();  // a run has those that are here
    const std::string name = process.name;
    const Container container(process, reports_exit());
    plans.push_back(plan_json(name, container));
  }
  if (json_path != "-") {
    for (const json& process : plans) {
      if (plans.size() > 1) rt::print("process {}\n\n", process.at("process").get<std::string>());
      print(process);
    }
  }
  if (!json_path.empty()) write_json({{"file", file}, {"processes", std::move(plans)}}, json_path);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command
      ->add_option("FILE", options->file,
                   "A configuration file; its components are constructed, but do not run")
      ->required();
  one_of(command->add_option("--method", options->method,
                             "How callbacks get priorities, as `priorities` of the file (default: "
                             "as the file says)"),
         {"picas", "rate_monotonic"});
  as_option(*command, options->as);
  add_output(*command, "--json", options->json, "Also write the plan as JSON; - for stdout");
  command->footer("Example:\n  takt plan robot.yaml\n  takt plan robot.yaml --as picas\n");
  command->callback([options] { plan(*options); });
}
const Command registered(
    "plan", "Shows the priorities, executors and CPUs that Takt assigns: PiCAS, rate monotonic",
    set_up);

}  // namespace
}  // namespace takt::tools::plan_command
