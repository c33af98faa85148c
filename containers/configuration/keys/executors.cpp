// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/configuration/keys/readers.hpp"
#include "takt/containers/configuration/reservations.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/spin_always.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/sched/scheduler_library.hpp"

namespace takt {
namespace {

OwnValue own_value(const document::Value& value) {
  OwnValue own{.name = value.name, .line = value.line};
  const auto add = [&](OwnValue::Kind kind, const std::vector<document::Value>& values) {
    own.kind = kind;
    for (const document::Value& each : values) own.values.push_back(own_value(each));
  };
  if (const auto* list = std::get_if<document::List>(&value.content)) {
    add(OwnValue::Kind::list, *list);
  } else if (const auto* map = std::get_if<document::Map>(&value.content)) {
    add(OwnValue::Kind::map, map->values);
  } else {
    std::visit(
        [&](const auto& content) {
          if constexpr (std::is_assignable_v<decltype(own.content)&, decltype(content)>)
            own.content = content;
        },
        value.content);
  }
  return own;
}

// The own keys of the registered class with this name. An unknown name is reported elsewhere, and
// any key may be one of its own.
template <class AnyRegistry>
std::vector<OwnKey> own_keys(const AnyRegistry& registry, const std::string& name,
                             const document::Value& value) {
  if (registry.knows(name)) return registry.traits(name).keys;
  std::vector<OwnKey> all;
  if (const auto* map = std::get_if<document::Map>(&value.content)) {
    for (const document::Value& each : map->values) all.push_back({each.name, {}});
  }
  return all;
}

// Checks a name. The name of a broken library, which was reported already, becomes `instead`.
std::function<void()> unless_broken(const std::set<std::string>& broken, const char* noun,
                                    std::string& name, std::string_view instead,
                                    void (*check)(std::string_view)) {
  return [&broken, noun, &name, instead, check] {
    if (broken.contains(fmt::format("{} {}", noun, name))) name = instead;
    if (name != instead) check(name);
  };
}

void check_name_of_scheduler(std::string_view name) {
  schedulers().check(name);
}

void find_type(const ExecutorDescription& executor) {
  if (executor.library.empty()) return executors().check(executor.type);
  load_executor(executor.type, executor.library);
}

void check_let_period(Nanoseconds period) {
  if (period != Nanoseconds::zero()) return;
  throw Error("a period of 0 cannot be kept", "remove it, or write a longer time");
}

// Only the executor type and the wait back end know how many threads they support. Constructing an
// executor starts no thread; but the constructor of one from a library may throw anything.
void try_to_make(const std::string& type, const ExecutorOptions& options) {
  const auto refuse = [&type](const char* what) {
    throw Error(fmt::format("executor '{}' throws in its constructor: {}", type, what),
                "let it throw takt::Error for options that it cannot serve, and nothing else");
  };
  try {
    executors().make(type, options);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    refuse(error.what());
  } catch (...) {
    refuse("an object that is not a std::exception");
  }
}

}  // namespace

// The library defines keys of its own, so it is loaded before the map is read; its check uses their
// values.
void ExecutorReader::read_scheduler(const Value& value) {
  const auto load = [&](const Value& place) {
    std::string library;
    read_library(place, library);
    if (library.empty()) return;
    const auto* map = std::get_if<document::Map>(&value.content);
    OwnValues& own = system_.schedulers[value.name];
    for (const Value& each : map->values) {
      if (each.name != place.name) own.push_back(own_value(each));
    }
    if (!errors_.passes(place.line, [&] { load_scheduler(value.name, library, own); })) {
      file_.broken.insert("scheduler " + value.name);
    }
  };
  std::vector<Field> fields = {
      {"library",
       "A shared library. A relative path starts at the folder of this file. A name without "
       "a slash is a file in this folder, else a library that the dynamic linker finds.",
       load, true}};
  if (is_describing()) return void(read_map(value, "a scheduler", fields));
  if (const Value* library = document::find(value, "library")) load(*library);
  fields.front().read = [](const Value&) {};
  const std::vector<OwnKey> keys = own_keys(schedulers(), value.name, value);
  for (const OwnKey& key : keys) fields.push_back({key.name, key.help, [](const Value&) {}});
  read_map(value, "a scheduler", fields);
}

void ExecutorReader::read_wait_backend(const Value& value) {
  const auto load = [&](const Value& place) {
    std::string library;
    read_library(place, library);
    if (library.empty()) return;
    if (!errors_.passes(place.line, [&] { load_wait_backend(value.name, library); })) {
      file_.broken.insert("wait back end " + value.name);
    }
  };
  read_map(
      value, "a wait back end",
      {{"library", "A shared library. It is found as the library of a scheduler is.", load, true}});
}

std::vector<SystemReader::Field> ExecutorReader::executor_fields(ExecutorDescription& executor,
                                                                 Threads& threads, bool& is_sound) {
  const auto of_library = [&](const char* noun, std::string& name, auto instead, auto check) {
    return noting(is_sound,
                  into_checked(name, unless_broken(file_.broken, noun, name, instead, check)));
  };
  // If `is_sound` is false, an error of the library was reported already.
  const auto find_it = [&] { return is_sound ? find_type(executor) : void(); };
  return {
      {"library",
       "A shared library that registers the type. It is found as the library of a scheduler is.",
       noting(is_sound, [&](const Value& library) { read_library(library, executor.library); })},
      {"type",
       "The executor type, see `takt list executors`. With `library`: the name that it registers, "
       "which is required.",
       noting(is_sound, into_checked(executor.type, find_it))},
      {"scheduler",
       "A scheduler of `takt list schedulers`, or a name in `schedulers`. By default, that of the "
       "type.",
       of_library("scheduler", executor.scheduler, "", check_name_of_scheduler)},
      {"wait",
       "How its threads wait: `auto`, a back end of `takt list wait_backends`, or a name in "
       "`wait_backends`. `auto`: `epoll` if there are file descriptors when spinning starts, else "
       "`futex`. `futex` with file descriptors and `io_uring` with several threads are errors.",
       of_library("wait back end", executor.wait, kAutoWait, check_wait_backend)},
      {"spin",
       "At most `1ms`, or `always`. A thread that finds nothing to run looks for arrivals for this "
       "long before it sleeps. What arrives meanwhile has no wake-up latency, but each wait uses "
       "that much CPU time. `always`: it never sleeps, so it needs a CPU of its own.",
       noting(is_sound, word_or(
                            "always", [&] { executor.spin = kSpinAlways; },
                            into_duration(executor.spin, [] {})))},
      {"early_wake",
       "At most `1ms`. The same for timers: a thread that sleeps until a release wakes up this "
       "much earlier and spins until then.",
       into_duration(executor.early_wake, [] {})},
      {"per",
       "For `isolated`: whether each node or each callback group gets its own executor and "
       "thread. With `group`, the thread takes over parameters of the callback group: the "
       "priority with SCHED_FIFO or SCHED_RR; budget, deadline and period with SCHED_DEADLINE.",
       into(executor.per, {{"node", Isolation::node}, {"group", Isolation::group}})},
      {"reentrant_threads",
       "For `isolated` with `per: group`: how many threads each reentrant callback group gets. All "
       "of them are as its first one.",
       noting(is_sound, into(executor.reentrant_threads, 1, kMostReentrantThreads))},
      {"trigger", "For `triggered`: the condition for serving ready callbacks.",
       noting(is_sound, into_trigger(executor.trigger))},
      {"let", "For `triggered`: the period of the logical execution time (LET). Not 0.",
       into_duration(executor.trigger.let_period,
                     [&] { check_let_period(executor.trigger.let_period); })},
      {"order",
       "Callbacks, as `node/callback`, that precede all others in the order of registration. For "
       "the scheduler `listed`, and for `ros` among callbacks of the same kind.",
       each_in_list([&](const Value& callback) { read_place(callback, executor.order); })},
      {"threads",
       "Names in `threads`, one for each thread of the executor. By default, the type decides. "
       "More threads than the type supports are an error.",
       each_in_list(
           [&](const Value& thread) { read_executors_thread(thread, executor, threads); })}};
}

void ExecutorReader::read_place(const Value& callback, std::vector<std::string>& order) {
  std::string name;
  into(name)(callback);
  const auto is_same = [&](const std::string& other) {
    return other == name || other == "/" + name || "/" + other == name;
  };
  if (!name.empty() && std::any_of(order.begin(), order.end(), is_same)) {
    errors_.add(callback.line, fmt::format("'{}' has a place already", name), "list it once");
  }
  order.push_back(std::move(name));
}

void ExecutorReader::read_executors_thread(const Value& thread, ExecutorDescription& executor,
                                           Threads& threads) {
  std::string name;
  into(name)(thread);
  if (name.empty()) return;
  for (const std::string& member : file_.threads.of_executor(name, executor, thread.line)) {
    executor.threads.push_back(member);
    threads.push_back(file_.threads.find(member, thread.line));
  }
}

void ExecutorReader::read_executor(const Value& value) {
  ExecutorDescription executor;
  executor.name = value.name;
  executor.where = errors_.where(value.line);
  Threads threads;
  bool is_sound = true;
  std::vector<Field> fields = executor_fields(executor, threads, is_sound);
  // Read the library and the type first: the type defines keys of its own.
  for (Field* field : {&fields[0], &fields[1]}) {
    const Value* found = is_describing() ? nullptr : find(value, "an executor", field->key);
    if (found == nullptr) continue;
    field->read(*found);
    field->read = [](const Value&) {};
  }
  const std::vector<OwnKey> keys = own_keys(executors(), executor.type, value);
  for (const Field& field : fields) {
    if (!executors().knows(executor.type) || !has_key(keys, field.key)) continue;
    errors_.add(
        value.line,
        fmt::format("type '{}' brings the key '{}', which is Takt's", executor.type, field.key),
        "let its traits name it otherwise");
  }
  for (const OwnKey& key : keys) {
    fields.push_back({key.name, key.help,
                      [&](const Value& of_key) { executor.own.push_back(own_value(of_key)); }});
  }
  read_map(value, "an executor", fields);
  if (!executor.library.empty() && document::find(value, "type") == nullptr) {
    errors_.add(value.line, "an executor with the key 'library' needs the key 'type'",
                "add it, with the name that the library registers");
    is_sound = false;
  }
  if (is_sound && executors().traits(executor.type).takes_band &&
      document::find(value, "threads") == nullptr) {
    errors_.add(value.line,
                fmt::format("executor '{}' of type '{}' has no threads, so nothing could interrupt",
                            executor.name, executor.type),
                "add `threads`, with one that has a band of priorities");
  }
  ExecutorOptions options = options_of(executor);
  options.threads = std::move(threads);
  if (file_.names_cpus) {
    for (ThreadAttributes& thread : options.threads) {
      if (!thread.affinity.empty()) thread.affinity = {available_cpus().front()};
    }
  }
  if (is_sound) errors_.passes(value.line, [&] { try_to_make(executor.type, options); });
  file_.executors.insert(executor.name);
  system_.executors.push_back(std::move(executor));
}

// Checks that concern the threads of all executors together.
void ExecutorReader::check_threads(const Value& where) {
  if (errors_.size() != 0) return;
  errors_.passes(where.line,
                 [this] { check_reservations(described_threads(system_), system_.machine); });
  if (errors_.size() == 0) errors_.passes(where.line, [this] { check_spinning_threads(); });
}

void ExecutorReader::check_spinning_threads() {
  std::vector<ThreadAttributes> spinning, others;
  std::set<std::string> names;
  for (const ExecutorDescription& executor : system_.executors) {
    if (executor.spin != kSpinAlways) continue;
    for (const std::string& name : executor.threads) {
      spinning.push_back(file_.threads.all().at(name).attributes);
    }
    if (executor.threads.empty()) spinning.push_back({.name = executor.name});
    names.insert(executor.threads.begin(), executor.threads.end());
  }
  for (const auto& [name, thread] : file_.threads.all()) {
    if (!names.contains(name)) others.push_back(thread.attributes);
  }
  check_spin_always(spinning, others);
  const RealtimeGrant granted = realtime_grant();
  for (const ThreadAttributes& thread : spinning) {
    if (!granted.is_limited() || !is_realtime(thread.policy)) continue;
    system_.notes.push_back(
        fmt::format("thread '{}' never sleeps (`spin: always`) and has {}: Linux grants it {}, "
                    "by kernel.sched_rt_runtime_us or its fair server",
                    thread.name, to_string(thread.policy), to_string(granted)));
  }
}

SystemReader::Read ExecutorReader::into_trigger(TriggerOptions& trigger) {
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
                 {{"one", "`node/callback`: serve when this callback is ready.", into(trigger.one),
                   true}});
      });
}

}  // namespace takt
