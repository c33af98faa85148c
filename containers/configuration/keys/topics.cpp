// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void TopicReader::read(const Value& value) {
  std::string name;
  if (!is_describing()) into_topic(name)({value.name, value.line, value.name});
  if (!name.empty() && !name.starts_with('/')) {
    errors_.add(value.line, fmt::format("'{}' is not the full name of a topic", name),
                fmt::format("write '/{}', with its namespaces", name));
  }
  QosOverrides qos;
  std::optional<int> depth;
  bool must_match = false;
  const int most_kept = static_cast<int>(QoS().keep_all().depth);
  const auto duration = [this](std::optional<Nanoseconds>& target) {
    return into_duration(target, [&target] { QoS().deadline(*target).check(); });
  };
  read_map(
      value, "a topic",
      {{"profile", "A QoS profile of rclcpp; the other keys override it.",
        into_profile(qos.profile)},
       {"depth", "Number of messages kept.",
        without_default([&] { return into(depth.emplace(), 1, most_kept); })},
       {"history", "`keep_all`: equal to `depth: 16384`; `depth` is ignored.",
        [&](const Value& history) {
          if (choose(history, {"keep_last", "keep_all"}) == 1) depth = most_kept;
        }},
       {"reliability", "A `reliable` subscription does not match a `best_effort` publisher.",
        into(qos.reliability, Words<Reliability>{{"reliable", Reliability::reliable},
                                                 {"best_effort", Reliability::best_effort}})},
       {"durability",
        "`transient_local`: late subscriptions receive the last `depth` messages; they do not "
        "match a `volatile` publisher.",
        into(qos.durability, Words<Durability>{{"volatile", Durability::volatile_},
                                               {"transient_local", Durability::transient_local}})},
       {"deadline",
        "Maximum time between two messages. A subscription with a deadline does not match a "
        "publisher with a longer one or none. `0s`: none, whatever the code says.",
        duration(qos.deadline)},
       {"lifespan", "Older messages are dropped, and counted. `0s`: none are.",
        duration(qos.lifespan)},
       {"liveliness",
        "`automatic`: a publisher is alive while its process is. `manual_by_topic`: it must "
        "publish or assert its liveliness.",
        into(qos.liveliness, Words<Liveliness>{{"automatic", Liveliness::automatic},
                                               {"manual_by_topic", Liveliness::manual_by_topic}})},
       {"lease_duration",
        "A publisher without a sign of life for this time is not alive. `0s`: each is.",
        duration(qos.lease_duration)},
       {"must_match",
        "`true`: the run fails if the topic has only publishers or only subscriptions 10 s after "
        "the start, or at the end of a shorter run.",
        into(must_match)},
       {"delay",
        "Between processes, the longest, for `takt analyze` and `takt simulate`; or `{min: 50us, "
        "max: 300us}`. Requests and answers of a service have the `delay` of an entry with its "
        "full name, which has no other key.",
        without_default([&] { return into_delay(system_.delays[value.name]); })}});
  if (must_match) system_.must_match.try_emplace(value.name, errors_.where(value.line));
  if (depth) qos.depth = static_cast<std::size_t>(*depth);
  system_.topics.try_emplace(value.name, qos);
  system_.topic_lines.try_emplace(value.name, errors_.where(value.line));
}

SystemReader::Read TopicReader::into_delay(DelayDescription& delay) {
  return either(into_duration(delay.longest, [] {}), [this, &delay](const Value& map) {
    const std::size_t before = errors_.size();
    read_map(map, "a delay",
             {{"min", "The shortest. By default, 0.", into_duration(delay.least, [] {})},
              {"max", "The longest.", into_duration(delay.longest, [] {}), true}});
    if (is_describing() || errors_.size() != before || delay.least <= delay.longest) return;
    errors_.add(map.line, "the shortest delay is longer than the longest", "exchange them");
  });
}

SystemReader::Read TopicReader::into_profile(std::optional<QoS>& profile) {
  Words<QoS> profiles;
  for (const std::string& name : qos_profile_names()) {
    profiles.emplace_back(name, *qos_profile(name));
  }
  return into(profile, std::move(profiles));
}

}  // namespace takt
