// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void CallbackReader::read_group(const Value& value, ComponentDescription& component) {
  CallbackGroupDescription group{.where = errors_.where(value.line)};
  std::vector<Field> fields = parameter_fields(group.parameters);
  fields.push_back({"executor",
                    "A name in `executors`, or `default`. By default, the component's executor.",
                    into_executor(group.executor)});
  fields.push_back(waits_field(group.waits));
  read_callback_map(value, "a callback group", fields, group.parameters);
  component.callback_groups.try_emplace(value.name, std::move(group));
}

void CallbackReader::read_callback(const Value& value, ComponentDescription& component) {
  CallbackDescription callback{.where = errors_.where(value.line)};
  std::vector<Field> fields = parameter_fields(callback.parameters);
  fields.push_back(
      {"execution",
       "Processor time of one execution, for `takt analyze`. A duration is the longest; `{min: "
       "1ms, max: 4ms}` states the shortest, too.",
       into_execution(callback.execution)});
  fields.push_back(waits_field(callback.waits));
  fields.push_back(
      {"arrival",
       "How often it is called, if that is decided outside of this file: by other "
       "programs, services, file descriptors, guard conditions. For `takt analyze`. It "
       "is of messages as they arrive: what their way adds to the jitter of the "
       "sender, a `delay`, is part of `jitter`.",
       into_arrival(callback.arrival)});
  fields.push_back({"outputs",
                    "When it publishes during an execution, for `takt analyze`: `end`, or `any`.",
                    into(callback.publishes_at_end, {{"end", true}, {"any", false}})});
  read_callback_map(value, "a callback", fields, callback.parameters);
  component.callbacks.try_emplace(value.name, std::move(callback));
}

SystemReader::Field CallbackReader::waits_field(std::optional<Nanoseconds>& waits) {
  return {"waits",
          "The most that one execution waits, in all: for a lock, a device, a reply, a sleep. For "
          "`takt analyze`: the thread runs nothing else meanwhile. By default, 0.",
          into_duration(waits)};
}

SystemReader::Read CallbackReader::into_execution(std::optional<ExecutionDescription>& execution) {
  return [this, &execution](const Value& value) {
    ExecutionDescription described;
    const auto check = [&described] {
      if (described.longest == Nanoseconds::zero()) {
        throw Error("an execution takes some time", "write more than 0");
      }
      if (described.least > described.longest) {
        throw Error(fmt::format("its shortest execution, {}, is longer than its longest, {}",
                                to_string(described.least), to_string(described.longest)),
                    "exchange them");
      }
    };
    either(into_duration(described.longest, check), [&](const Value& map) {
      const std::size_t before = errors_.size();
      read_map(map, "an execution",
               {{"min", "The shortest. By default, 0.", into_duration(described.least, [] {})},
                {"max", "The longest.", into_duration(described.longest, [] {}), true}});
      if (errors_.size() == before && !is_describing()) errors_.passes(map.line, check);
    })(value);
    execution = described;
  };
}

SystemReader::Read CallbackReader::into_arrival(std::optional<ArrivalDescription>& arrival) {
  return [this, &arrival](const Value& value) {
    ArrivalDescription& described = arrival.emplace();
    const std::size_t before = errors_.size();
    read_map(value, "an arrival",
             {{"period", "The time from one to the next.", into_duration(described.period, [] {})},
              {"jitter", "The most by which each is late.", into_duration(described.jitter, [] {})},
              {"least_distance", "No two are closer, whatever the jitter.",
               into_duration(described.least_distance, [] {})},
              {"distances",
               "Instead of the other keys: the least time from the first of 2, 3, … arrivals in a "
               "row to the last of them, none less than the one before. Further ones follow.",
               into_distances(described.distances)}});
    if (is_describing() || errors_.size() != before) return;
    errors_.passes(value.line, [&] {
      if (described.distances.empty() == (described.period == Nanoseconds::zero())) {
        throw Error("an arrival has either a period or distances", "write one of them");
      }
      if (!described.distances.empty() &&
          described.jitter + described.least_distance != Nanoseconds::zero()) {
        throw Error("an arrival that has distances has all in them", "leave out the other keys");
      }
      if (described.distances.empty() && described.least_distance > described.period) {
        throw Error(fmt::format("no two arrivals are closer than {}, and one comes every {}",
                                to_string(described.least_distance), to_string(described.period)),
                    "write a least distance of the period at most");
      }
    });
  };
}

SystemReader::Read CallbackReader::into_distances(std::vector<Nanoseconds>& distances) {
  return [this, &distances](const Value& value) {
    each_in_list([&](const Value& distance) {
      Nanoseconds read{0};
      into_duration(read, [] {})(distance);
      if (is_describing()) return;
      if (!distances.empty() && read < distances.back()) {
        errors_.add(distance.line, "a distance is less than the one before it",
                    "the first of more arrivals is not closer to the last one");
      }
      distances.push_back(read);
    })(value);
    if (is_describing() || distances.empty() || distances.back() > Nanoseconds::zero()) return;
    errors_.add(value.line, "any number of arrivals may come at once", "add a distance above 0");
  };
}

void CallbackReader::read_callback_map(const Value& value, std::string_view whose,
                                       const std::vector<Field>& fields,
                                       const CallbackParameters& parameters) {
  const std::size_t before = errors_.size();
  read_map(value, whose, fields);
  if (errors_.size() == before) errors_.passes(value.line, [&] { parameters.check(); });
}

std::vector<SystemReader::Field> CallbackReader::parameter_fields(CallbackParameters& parameters) {
  return {
      {"priority",
       "A larger number is more urgent. By default, what Takt assigns to callbacks of `chains`, "
       "else 0. For the schedulers `fixed_priority` and `chain_priority`; [which callback runs "
       "first](../explanation/priorities.md).",
       into(parameters.priority)},
      {"deadline",
       "Relative deadline of the callback's end, from the publication or a timer's due time. "
       "Not 0. For the schedulers `edf` and `least_laxity`. Misses are counted and reported.",
       into_duration(parameters.deadline)},
      {"period",
       "Minimum time between two messages. Not 0. By default, the period of a timer, which has no "
       "other one. `takt analyze` takes it as a promise of what comes from outside of the file; "
       "how often callbacks of the file send, it knows.",
       into_duration(parameters.period)},
      {"budget",
       "Maximum execution time of the callback, in wall-clock time. Not 0, and at most "
       "deadline and period. A longer execution is an overrun. `takt analyze` counts `execution` "
       "where both are given, also if it is longer.",
       into_duration(parameters.budget)},
      {"criticality",
       "A larger number is more critical. By default, the priority of its chain, else 0. For "
       "`chain_priority`.",
       into(parameters.criticality)},
      {"overrun",
       "Reaction when the callback misses its deadline, exceeds its budget, or is a timer that "
       "still runs at its next release; by default `catch_up`. `catch_up`: one of the missed "
       "releases is served at once. `skip`: missed releases are dropped, and the timer keeps "
       "its phase. `abort`: the chain instance ends, and its messages are not delivered. "
       "`demote`: the callback runs after all others until one execution stays in time. Every "
       "overrun is counted.",
       into(parameters.overrun, overrun_policies())},
      {"releases",
       "How many releases of a timer may wait; by default 1, and those that come due meanwhile are "
       "missed. With more, each is served, the oldest first; of those beyond, the oldest are "
       "missed, and counted. Of no effect on other callbacks.",
       into(parameters.releases, 1)}};
}

std::map<std::string, CallbackParameterChanges> CallbackReader::read_changes(const Value& root) {
  std::map<std::string, CallbackParameterChanges> changes;
  each_in_map([&](const Value& node) { read_changes(node, changes[node.name]); })(root);
  return changes;
}

void CallbackReader::read_changes(const Value& value, CallbackParameterChanges& changes) {
  const auto each = [this](auto& target) {
    return each_in_map([this, &target](const Value& entry) {
      CallbackParameters& parameters = target[entry.name];
      read_callback_map(entry, "a callback", parameter_fields(parameters), parameters);
    });
  };
  read_map(value, "a node",
           {{"callback_groups", "Changes by name.", each(changes.callback_groups)},
            {"callbacks", "Changes by name.", each(changes.callbacks)}});
}

}  // namespace takt
