// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "takt/base/available_cpus.hpp"
#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {
namespace {

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  return number;
}

}  // namespace

void ThreadReader::read(const Value& value) {
  ThreadAttributes asked{.name = value.name};
  int highest = 0;  // of a band; 0: no band
  bool is_sound = true;
  const bool fits = read_map(
      value, "a thread",
      {{"policy", "The Linux scheduling policy.", noting(is_sound, into_policy(asked.policy))},
       {"priority",
        "1 to 99, required for SCHED_FIFO and SCHED_RR. For all other policies it must be 0. A "
        "band "
        "of SCHED_FIFO, for executors of the type `preemptive`, is a thread for each priority, on "
        "one CPU.",
        noting(is_sound, into_priority(asked.priority, highest))},
       {"nice", "-20 to 19. Not for SCHED_FIFO, SCHED_RR and SCHED_DEADLINE.",
        noting(is_sound, into(asked.nice))},
       {"affinity",
        "CPUs on which the thread may run, isolated ones, too; by default, all CPUs that the "
        "process was started on. Not for "
        "SCHED_DEADLINE: the kernel refuses it. To restrict such threads, run the process in an "
        "exclusive cpuset.",
        each_in_list([&](const Value& cpu) { read_cpu(cpu, asked.affinity); })},
       {"runtime",
        "CPU time that a SCHED_DEADLINE thread gets in every period, and cannot exceed. At least "
        "`1024ns`. Required with this policy, as is `period`.",
        noting(is_sound, into_duration(asked.runtime, [] {}))},
       {"deadline",
        "Relative deadline by which a SCHED_DEADLINE thread gets its runtime. At least the "
        "runtime, at most the period, which is the default. A deadline shorter than the period "
        "suits threads that wake once per period: if one wakes again after its deadline, the "
        "kernel lets it wait for the next period.",
        noting(is_sound, into_duration(asked.deadline, [] {}))},
       {"period", "For SCHED_DEADLINE. The kernel accepts `100us` to about `4.19s`.",
        noting(is_sound, into_duration(asked.period, [] {}))}});
  if (const Value* cpus = document::find(value, "affinity")) check_is_some(*cpus);
  // Skip the checks after an unknown key: it may be a misspelt key that a check would report as
  // missing.
  is_sound &= fits;
  if (is_sound) {
    // Separate checks: so each error has its own line, and none hides another.
    is_sound &= passes(value, "priority", [&] { asked.check_priority(); });
    is_sound &= passes(value, "nice", [&] { asked.check_nice(); });
    is_sound &= passes(value, "runtime", [&] { asked.check_reservation(); });
    is_sound &= passes(value, "policy", [&] {
      if (asked.name != "lttng" || asked.policy != ThreadPolicy::deadline) return;
      throw Error("LTTng's threads cannot have a reservation: no thread inherits one",
                  "give 'lttng' another policy");
    });
    ThreadAttributes here = asked;
    if (file_.names_cpus && !asked.affinity.empty()) here.affinity = {available_cpus().front()};
    is_sound &= passes(value, "affinity", [&] { here.check_affinity(); });
  }
  if (!is_sound) asked = {.name = asked.name};  // so that its executors do not report it again
  const auto add = [&](const ThreadAttributes& thread) {
    file_.threads.add(thread, value.line);
    system_.threads.push_back({thread, errors_.where(value.line)});
  };
  if (highest == 0) return add(asked);
  const int line = document::find(value, "priority")->line;
  for (const auto& thread : file_.threads.band(asked, highest, is_sound, line)) add(thread);
}

// Reads a priority or a band. `highest` stays 0 for a single priority.
SystemReader::Read ThreadReader::into_priority(int& priority, int& highest) {
  return [this, &priority, &highest](const Value& value) {
    if (is_describing()) return into(priority)(value), void(describes("a band such as `60..68`"));
    const auto* const text = std::get_if<std::string>(&value.content);
    const std::size_t dots = text != nullptr ? text->find("..") : std::string::npos;
    if (dots == std::string::npos) return into(priority)(value);
    const auto first = whole_number(std::string_view(*text).substr(0, dots));
    const auto last = whole_number(std::string_view(*text).substr(dots + 2));
    if (!first || !last) return refuse(value, "a priority, or a band such as 60..68");
    priority = *first;
    highest = *last;
  };
}

SystemReader::Read ThreadReader::into_policy(ThreadPolicy& policy) {
  Words<ThreadPolicy> policies;
  for (const ThreadPolicy known :
       {ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr, ThreadPolicy::batch,
        ThreadPolicy::idle, ThreadPolicy::deadline}) {
    policies.emplace_back(to_string(known), known);
  }
  return into(policy, std::move(policies));
}

void ThreadReader::read_cpu(const Value& value, std::vector<int>& cpus) {
  if (describes("integer from 0")) return;
  int cpu = -1;
  into(cpu, 0)(value);
  if (cpu < 0) return;
  if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) {
    return errors_.add(value.line, fmt::format("CPU {} is in the list twice", cpu),
                       "name each CPU once");
  }
  if (file_.names_cpus) return cpus.push_back(cpu);  // see check_cpus_of_threads
  if (errors_.passes(value.line, [&] { ThreadAttributes{.affinity = {cpu}}.check(); })) {
    cpus.push_back(cpu);
  }
}

}  // namespace takt
