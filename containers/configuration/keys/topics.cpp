// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_topic(const Value& value) {
  std::string name;
  into_topic(name)({value.name, value.line, value.name});
  if (!name.empty() && !name.starts_with('/')) {
    errors_.add(value.line, fmt::format("'{}' is no full name of a topic", name),
                fmt::format("write '/{}', with its namespaces", name));
  }
  QosOverrides qos;
  std::optional<int> depth;
  bool must_match = false;
  const int most_kept = static_cast<int>(QoS().keep_all().depth);
  Words<QoS> profiles;
  for (const std::string& profile : qos_profile_names()) {
    profiles.emplace_back(profile, *qos_profile(profile));
  }
  const auto duration = [this](std::optional<Nanoseconds>& target) -> Read {
    return [this, &target](const Value& time) {
      into_duration(target.emplace(), [&target] { QoS().deadline(*target).check(); })(time);
    };
  };
  read_map(
      value, "a topic",
      {{"profile", "rclcpp's, by name; the other keys come on top.",
        into(qos.profile, std::move(profiles))},
       {"depth", "How many messages are kept.",
        without_default([&] { return into(depth.emplace(), 1, most_kept); })},
       {"history", "`keep_all`: as `depth: 16384`, whatever `depth` is.",
        [&](const Value& history) {
          if (choose(history, {"keep_last", "keep_all"}) == 1) depth = most_kept;
        }},
       {"reliability", "`best_effort` does not serve who asks for `reliable`.",
        into(qos.reliability, Words<Reliability>{{"reliable", Reliability::reliable},
                                                 {"best_effort", Reliability::best_effort}})},
       {"durability",
        "`transient_local`: who comes late gets the last `depth` messages; `volatile` does "
        "not serve who asks for it.",
        into(qos.durability, Words<Durability>{{"volatile", Durability::volatile_},
                                               {"transient_local", Durability::transient_local}})},
       {"deadline",
        "There is a message at least so often. An offer that is longer, or none, does not "
        "serve who asks for one.",
        duration(qos.deadline)},
       {"lifespan", "Messages that are older are not delivered, but counted as dropped.",
        duration(qos.lifespan)},
       {"liveliness",
        "`automatic`: a publisher is alive while its process is. `manual_by_topic`: while "
        "it publishes, or asserts that it is.",
        into(qos.liveliness, Words<Liveliness>{{"automatic", Liveliness::automatic},
                                               {"manual_by_topic", Liveliness::manual_by_topic}})},
       {"lease_duration", "Who is not heard of for so long is not alive.",
        duration(qos.lease_duration)},
       {"must_match",
        "`true`: the run has failed if only publishers, or only subscriptions, are known 10 s "
        "after its start, or at its end if that comes before.",
        into(must_match)}});
  if (must_match) system_.must_match.try_emplace(value.name, errors_.where(value.line));
  if (depth) qos.depth = static_cast<std::size_t>(*depth);
  system_.topics.try_emplace(value.name, qos);
  system_.topic_lines.try_emplace(value.name, errors_.where(value.line));
}

}  // namespace takt
