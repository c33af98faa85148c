// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void MachineReader::read(const Value& value) {
  MachineDescription& machine = system_.machine;
  read_map(
      value, "a machine",
      {{"cpus",
        "The CPUs on which the system runs, as a list or a number of them. By default, those of "
        "this process.",
        into_cpus(machine.cpus)},
       {"speed", "By CPU, 1 if not given: execution times are divided by it.",
        each_in_map([this](const Value& speed) { read_speed(speed); })},
       {"overheads", "Times that Linux and Takt need besides the callbacks.",
        [this](const Value& overheads) { read_overheads(overheads); }},
       {"rt_runtime",
        "Processor time of each second that Linux grants to the real-time threads of a CPU "
        "(`sched_rt_runtime_us`), or `unlimited`. By default, as on this machine.",
        into_rt_runtime(machine.rt_runtime)},
       {"exclusive",
        "A promise: nothing but this system runs on these CPUs. Without it, there are no bounds "
        "for threads that are not real-time ones.",
        into(machine.is_exclusive)}});
  const std::vector<int>& cpus = machine.cpus;
  for (const auto& [cpu, speed] : machine.speed) {
    if (cpus.empty() || std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) continue;
    errors_.add(document::find(value, "speed")->line,
                fmt::format("CPU {} has a speed, and is none of `machine: cpus`", cpu),
                fmt::format("choose from {}", fmt::join(cpus, ", ")));
  }
}

void MachineReader::read_overheads(const Value& value) {
  MachineDescription& machine = system_.machine;
  const auto publishing = [&](const Value& map) {
    read_map(map, "a publishing overhead",
             {{"message", "For each message, to one subscription.", into_duration(machine.publish),
               true},
              {"receiver", "For each other subscription that gets it, besides.",
               into_duration(machine.publish_receiver)},
              {"megabyte", "For each megabyte of it, besides.",
               into_duration(machine.publish_megabyte)}});
  };
  read_map(
      value, "overheads",
      {{"dispatch", "Before each callback.", into_duration(machine.dispatch)},
       {"wake",
        "To wake a sleeping thread: the most by which a timer is late, without the `switch` to the "
        "thread, which counts besides. That of a model has both in it.",
        into_duration(machine.wake)},
       {"switch",
        "From one thread to another: once for each that wakes, twice for each preemption.",
        into_duration(machine.change)},
       {"publish",
        "To send a message, and as much again to take one of another process, for callbacks "
        "whose execution time the component itself says; measured and declared times have "
        "both in them.",
        either(into_duration(machine.publish), publishing)}});
}

// A thread bound to a CPU that `machine: cpus` lacks would be analysed on an undescribed CPU.
void MachineReader::check_cpus_of_threads() {
  const std::vector<int>& cpus = system_.machine.cpus;
  if (cpus.empty()) return;
  for (const ThreadDescription& thread : system_.threads) {
    for (const int cpu : thread.attributes.affinity) {
      if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) continue;
      errors_.add(file_.threads.all().at(thread.attributes.name).line,
                  fmt::format("thread '{}' is bound to CPU {}, which is none of `machine: cpus`",
                              thread.attributes.name, cpu),
                  fmt::format("choose from {}", fmt::join(cpus, ", ")));
    }
  }
}

SystemReader::Read MachineReader::into_cpus(std::vector<int>& cpus) {
  return [this, &cpus](const Value& value) {
    int count = 0;
    if (std::holds_alternative<document::List>(value.content) || is_describing()) {
      each_in_list([&](const Value& entry) {
        int cpu = 0;
        into(cpu, 0)(entry);
        if (is_describing()) return;
        if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) {
          errors_.add(entry.line, fmt::format("CPU {} is in the list twice", cpu),
                      "name each CPU once");
        }
        cpus.push_back(cpu);
      })(value);
      check_is_some(value);
    } else {
      into(count, 1, 1024)(value);
    }
    for (int cpu = 0; cpu < count; ++cpu) cpus.push_back(cpu);
  };
}

void MachineReader::read_speed(const Value& value) {
  double speed = 1;
  into(speed)(value);
  if (is_describing()) return;
  int cpu = -1;
  const char* const end = value.name.data() + value.name.size();
  if (std::from_chars(value.name.data(), end, cpu).ptr != end || cpu < 0) {
    errors_.add(value.line, fmt::format("'{}' is not a CPU", value.name), "write its number");
    return;
  }
  if (!(speed >= 0.001 && speed <= 1000)) {
    errors_.add(value.line, fmt::format("CPU {} has a speed of {}", value.name, speed),
                "write a number of 0.001 to 1000; 0.5 makes executions twice as long");
    return;
  }
  if (!system_.machine.speed.try_emplace(cpu, speed).second) {
    errors_.add(value.line,
                fmt::format("'{}' is CPU {}, which has a speed already", value.name, cpu),
                "name each CPU once");
  }
}

SystemReader::Read MachineReader::into_rt_runtime(std::optional<Nanoseconds>& runtime) {
  return word_or(
      "unlimited", [&runtime] { runtime = std::chrono::seconds(1); },
      without_default([this, &runtime] {
        return into_duration(runtime.emplace(), [&runtime] {
          if (*runtime >= std::chrono::microseconds(1) && *runtime <= std::chrono::seconds(1))
            return;
          throw Error("of a second Linux grants 1us to 1s", "write as much, or `unlimited`");
        });
      }));
}

}  // namespace takt
