// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_thread(const Value& value) {
  ThreadAttributes asked{.name = value.name};
  bool is_sound = true;
  const bool fits = read_map(
      value, "a thread",
      {{"policy", "The Linux policy.", noting(is_sound, into_policy(asked.policy))},
       {"priority",
        "1 to 99 for SCHED_FIFO and SCHED_RR, and needed there; for the others it must be 0.",
        noting(is_sound, into(asked.priority))},
       {"nice", "-20 to 19. Not for SCHED_FIFO, SCHED_RR and SCHED_DEADLINE.",
        noting(is_sound, into(asked.nice))},
       {"affinity",
        "CPUs that this process may use; without it, all. Not for SCHED_DEADLINE: the kernel "
        "refuses it. To keep such threads on some CPUs, run the process in an exclusive cpuset.",
        each_in_list([&](const Value& cpu) { read_cpu(cpu, asked.affinity); })},
       {"runtime",
        "From `1024ns`. For SCHED_DEADLINE, and needed there, as is `period`: in every period "
        "the thread gets this much CPU time, and then no more.",
        noting(is_sound, into_duration(asked.runtime, [] {}))},
       {"deadline",
        "From the runtime to the period; without it, the period. For SCHED_DEADLINE: it gets "
        "its time by then. Shorter than the period, it is for threads that wake once a period: "
        "the kernel lets one that wakes again, later than its deadline, wait for the next "
        "period.",
        noting(is_sound, into_duration(asked.deadline, [] {}))},
       {"period", "For SCHED_DEADLINE. The kernel takes `100us` to about `4.19s`.",
        noting(is_sound, into_duration(asked.period, [] {}))}});
  // An unknown key may be a wrong word for the one that the checks would miss.
  is_sound &= fits;
  if (is_sound) {
    // Each by itself, so that each error has its own line and none hides another.
    is_sound &= passes(value, "priority", [&] { asked.check_priority(); });
    is_sound &= passes(value, "nice", [&] { asked.check_nice(); });
    is_sound &= passes(value, "runtime", [&] { asked.check_reservation(); });
    is_sound &= passes(value, "affinity", [&] { asked.check_affinity(); });
  }
  if (!is_sound) asked = {.name = asked.name};  // or its executors would complain again
  threads_.try_emplace(asked.name, asked);
  system_.threads.push_back({std::move(asked), errors_.where(value.line)});
}

// An error is one of the key's line, or of the thread's when it has none.
bool ConfigurationReader::passes(const Value& thread, std::string_view key,
                                 const std::function<void()>& check) {
  const Value* place = document::find(thread, key);
  return errors_.passes((place != nullptr ? *place : thread).line, check);
}

SystemReader::Read ConfigurationReader::into_policy(ThreadPolicy& policy) {
  Words<ThreadPolicy> policies;
  for (const ThreadPolicy known :
       {ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr, ThreadPolicy::batch,
        ThreadPolicy::idle, ThreadPolicy::deadline}) {
    policies.emplace_back(to_string(known), known);
  }
  return into(policy, std::move(policies));
}

void ConfigurationReader::read_cpu(const Value& value, std::vector<int>& cpus) {
  if (describes("integer from 0")) return;
  int cpu = -1;
  into(cpu, 0)(value);
  if (cpu < 0) return;
  if (errors_.passes(value.line, [&] { ThreadAttributes{.affinity = {cpu}}.check(); })) {
    cpus.push_back(cpu);
  }
}

}  // namespace takt
