// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

template class Registry<Executor, ExecutorTraits, const ExecutorOptions&>;

ExecutorRegistry& executors() {
  static ExecutorRegistry registry("executor");
  return registry;
}

bool register_executor(std::string name, ExecutorRegistry::Entry entry, const char* version) {
  entry.factory = [make = std::move(entry.factory),
                   keys = entry.traits.keys](const ExecutorOptions& options) {
    for (const OwnValue& value : options.own) {
      if (has_key(keys, value.name)) continue;
      value.refuse(fmt::format("executor '{}' is of a type without this key", options.name));
    }
    return make(options);
  };
  return register_in(executors(), std::move(name), std::move(entry), version);
}

bool register_executor(std::string name, std::string description, ExecutorTraits traits,
                       const char* version) {
  traits.simulated = true;
  return register_executor(std::move(name),
                           {std::move(description),
                            [traits](const ExecutorOptions& options) {
                              return std::make_unique<DispatchingExecutor>(options, traits);
                            },
                            traits},
                           version);
}

void Executor::begin_trace(std::size_t) {
  throw Error("an executor of its own class cannot be traced while it runs",
              "let it implement begin_trace, end_trace and traces, by its CallbackObserver");
}

void load_executor(const std::string& name, const std::string& library) {
  load_registered(executors(), name, library, [&](const auto& entry) {
    const std::string& scheduler = entry.traits.scheduler;
    const std::vector<std::string> known = schedulers().names();
    if (std::find(known.begin(), known.end(), scheduler) != known.end()) return;
    throw Error(fmt::format("executor '{}' needs scheduler '{}'", name, scheduler),
                "name it and its library under 'schedulers'");
  });
}

}  // namespace takt
