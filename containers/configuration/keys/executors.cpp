// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/sched/scheduler_library.hpp"

namespace takt {

void ConfigurationReader::read_scheduler(const Value& value) {
  const auto load = [&](const Value& place) {
    std::string library;
    read_library(place, library);
    if (library.empty()) return;
    if (!errors_.passes(place.line, [&] { load_scheduler(value.name, library); })) {
      broken_schedulers_.insert(value.name);
    }
  };
  read_map(value, "a scheduler",
           {{"library",
             "A shared library. With a slash: a path, from the folder of this file if it is "
             "relative. Without one: a file beside this file, or else a library of the system, as "
             "the dynamic linker finds it.",
             load, true}});
}

SystemReader::Read ConfigurationReader::into_scheduler(std::string& target) {
  return into_checked(target, [this, &target] {
    if (broken_schedulers_.contains(target)) return target.clear();  // an error has told
    schedulers().check(target);
  });
}

void ConfigurationReader::read_executor(const Value& value) {
  ExecutorDescription executor;
  executor.name = value.name;
  executor.where = errors_.where(value.line);
  ExecutorOptions options{.name = value.name};
  bool is_sound = true;
  read_map(
      value, "an executor",
      {{"type", "See `takt list executors`.",
        noting(is_sound, into_checked(executor.type, [&] { executors().check(executor.type); }))},
       {"scheduler",
        "See `takt list schedulers`, or a name in `schedulers`. Without it, the type's own.",
        noting(is_sound, into_scheduler(executor.scheduler))},
       {"wait",
        "How its threads sleep: `auto`, or see `takt list wait_backends`. `auto`: `futex`, or "
        "`epoll` if there are file descriptors when it first spins. `futex` serves no file "
        "descriptors, and `io_uring` one thread only: both are refused where they cannot serve.",
        noting(is_sound, into_checked(executor.wait, [&] { check_wait_backend(executor.wait); }))},
       {"early_wake",
        "Up to `1ms`. A thread that sleeps until a timer wakes so much earlier and looks at the "
        "clock until the release: no wake-up latency, for that much of a CPU at each sleep.",
        into_duration(executor.early_wake, [] {})},
       {"per",
        "For `isolated`: what gets an executor and a thread of its own. With `group`, the "
        "thread of a callback group takes over its parameters: the priority if its policy is "
        "SCHED_FIFO or SCHED_RR; budget, deadline and period if it is SCHED_DEADLINE.",
        into(executor.per, {{"node", Isolation::node}, {"group", Isolation::group}})},
       {"trigger", "For `triggered`: when what is ready is served.",
        noting(is_sound, into_trigger(executor.trigger))},
       {"let", "For `triggered`: the period of its logical execution time; not 0.",
        into_duration(executor.trigger.let_period,
                      [&] {
                        if (executor.trigger.let_period != Nanoseconds::zero()) return;
                        throw Error("a period of 0 cannot be kept",
                                    "leave it out, or give it time");
                      })},
       {"order",
        "`node/callback`: those that come first in the order of registration, for the "
        "schedulers `listed` and, inside a kind, `ros`.",
        each_in_list(
            [&](const Value& callback) { into(executor.order.emplace_back())(callback); })},
       {"threads",
        "Names in `threads`, one for each thread of the executor. Without them, the type's own. "
        "More than the type takes are an error.",
        each_in_list([&](const Value& thread) {
          std::string name;
          into(name)(thread);
          if (name.empty()) return;
          executor.threads.push_back(name);
          options.threads.push_back(find_thread(thread.line, name));
          executors_threads_.push_back(options.threads.back());
        })}});
  options.scheduler = executor.scheduler;
  options.wait = executor.wait;
  options.early_wake = executor.early_wake;
  options.per = executor.per;
  options.trigger = executor.trigger;
  // Only the type itself knows how many threads it can take, and the wait back end whether it
  // serves so many. Making them starts none.
  if (is_sound) errors_.passes(value.line, [&] { executors().make(executor.type, options); });
  executors_.insert(executor.name);
  system_.executors.push_back(std::move(executor));
}

SystemReader::Read ConfigurationReader::into_trigger(TriggerOptions& trigger) {
  const Read word =
      into(trigger.kind, {{"any", TriggerOptions::Kind::any}, {"all", TriggerOptions::Kind::all}});
  return either(
      [this, word](const Value& value) {
        const auto* text = std::get_if<std::string>(&value.content);
        if (is_describing() || (text != nullptr && (*text == "any" || *text == "all"))) {
          return word(value);
        }
        refuse(value, "any, all, or {one: node/callback}");
      },
      [this, &trigger](const Value& value) {
        trigger.kind = TriggerOptions::Kind::one;
        read_map(value, "a trigger",
                 {{"one", "`node/callback`: when this one is ready.", into(trigger.one), true}});
      });
}

// The attributes of what is called so; those of a plain thread, and an error, when nothing is.
ThreadAttributes ConfigurationReader::find_thread(int line, const std::string& name) {
  if (const auto found = threads_.find(name); found != threads_.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, attributes] : threads_) names.push_back(known);
  errors_.add(line, fmt::format("no thread is called '{}'", name),
              names.empty() ? "describe it under 'threads'" : suggest(name, names));
  return {};
}

SystemReader::Read ConfigurationReader::into_executor(std::string& target) {
  return into_checked(target, [this, &target] {
    if (executors_.contains(target)) return;
    throw Error(fmt::format("no executor is called '{}'", target),
                suggest(target, std::vector(executors_.begin(), executors_.end())));
  });
}

}  // namespace takt
