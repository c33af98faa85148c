// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/assumption.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include <fmt/format.h>

namespace takt {
namespace {

constexpr bool kOfContainers = true;
constexpr std::array kKinds{
    AssumptionKind{"as_declared", "what the file or the code states, and no run has shown, is so",
                   "", "execution times, periods and arrivals",
                   "measure it: `takt run --trace`, `takt model`, `--model`"},
    AssumptionKind{"as_measured", "nothing is worse than in the measured run, and its margin", "",
                   "", "measure longer and under the worst load, then accept it"},
    AssumptionKind{"brought_up_by_others",
                   "somebody outside of the file brings nodes up, as in the measured run", "", "",
                   "`lifecycle: {bring_up: [NODE]}`", kOfContainers},
    AssumptionKind{"budgets_hold", "no execution is longer than its `budget`",
                   "while it runs: each overrun is counted and reported", "", ""},
    AssumptionKind{
        "dds_threads_elsewhere",
        "the threads of DDS, and Takt's own, need no time on the CPUs of callbacks", "", "",
        "give threads that run callbacks SCHED_FIFO; bind the other ones (`affinity`) to "
        "other CPUs"},
    AssumptionKind{"host_not_shared", "the host takes no CPU away from this virtual machine", "",
                   "the steal of each CPU", "use a machine that is not virtual"},
    AssumptionKind{"model_from_elsewhere",
                   "what was measured on another machine or build is so here", "", "",
                   "measure here: `takt run --trace`, `takt model`"},
    AssumptionKind{"no_other_publishers",
                   "nobody outside of the file sends to its callbacks, or receives what they send",
                   "", "", "`dds: {discovery: \"off\"}`, if nobody shall", kOfContainers},
    AssumptionKind{"no_page_faults", "memory of the process stays where it is", "",
                   "the page faults of each thread",
                   "`memory: {lock: true}` and `realtime: require`"},
    AssumptionKind{"not_seen", "what the measured run has not shown never happens", "", "",
                   "measure a run in which it happens, or declare it"},
    AssumptionKind{"nothing_else_runs",
                   "no thread outside of the file runs on its CPUs before those of callbacks",
                   "when it is analysed: those that are there are named",
                   "who has run before each thread", ""},
    AssumptionKind{
        "nothing_is_changed",
        "no container gets or unloads a component, no callback gets other parameters, and "
        "active nodes stay active",
        "", "what containers do, and what nodes change of their callbacks",
        "name the model in the file (`model`): then a container refuses to load and to "
        "change what takes a guarantee away of its own chains; nothing refuses to unload, to "
        "deactivate a node, or what a node does by itself",
        kOfContainers},
    AssumptionKind{"overheads_are_zero", "Linux and Takt need no time besides that of callbacks",
                   "", "",
                   "`--overheads measure`, a model of a longer run, or `machine: {overheads: "
                   "{dispatch: …, wake: …, switch: …, publish: …}}`"},
    AssumptionKind{"realtime_granted", "Linux gives all threads their policies and priorities",
                   "at the start, with `realtime: require`: what is refused ends the run",
                   "also who changes them", "`realtime: require`"},
    AssumptionKind{"requests_are_answered", "each request is answered in time", "", "",
                   "measure a run, or give the client's callback an `arrival`"},
    AssumptionKind{"rt_runtime_as_here",
                   "Linux throttles real-time threads as on this machine, which take turns of 100 "
                   "ms under SCHED_RR, and the fair server of newer kernels (6.12) runs others "
                   "before them only then",
                   "when it is analysed", "all, but not of reserved threads",
                   "`machine: {rt_runtime: …}`; a kernel whose fair server is off (0 in "
                   "`/sys/kernel/debug/sched/fair_server/cpu*/runtime`)"},
    AssumptionKind{
        "reservations_end", "the kernel ends the budget of a reservation when it is used up", "",
        "",
        "let what the callbacks of each reservation need, and its `spin`, be less than its "
        "budget: without HRTICK_DL the kernel looks once a tick"},
    AssumptionKind{"start_is_over", "the start is over: its bursts and constructors do not count",
                   "", "", "`from: activation` in the chain"},
    AssumptionKind{"times_scale_with_speed",
                   "execution times are those of one CPU divided by the speed of another", "", "",
                   "measure on the CPUs themselves, and leave out `machine: speed`"},
};

}  // namespace

std::string_view to_string(Assumption::State state) noexcept {
  switch (state) {
    case Assumption::State::checked:
      return "checked";
    case Assumption::State::unchecked:
      return "unchecked";
    case Assumption::State::refuted:
      return "refuted";
    case Assumption::State::not_covered:
      break;
  }
  return "not covered";
}

// FNV-1a: it tells sentences apart, and keeps nobody from accepting what nobody has read.
std::string digest_of(const Assumption& assumption) {
  std::uint32_t value = 0x811c9dc5;
  for (const char letter : assumption.text)
    value = (value ^ static_cast<unsigned char>(letter)) * 0x01000193;
  return fmt::format("{:08x}", value);
}

std::pair<std::string_view, std::string_view> split_accepted(std::string_view key) noexcept {
  const std::size_t end = key.find('@');
  if (end == key.npos) return {key, {}};
  return {key.substr(0, end), key.substr(end + 1)};
}

std::span<const AssumptionKind> assumption_kinds() {
  return kKinds;
}

std::string check_of(const AssumptionKind& kind, bool may_watch) {
  std::string result(kind.check);
  if (!may_watch || kind.watched.empty()) return result;
  if (!result.empty()) result += "; ";
  return result + "while it runs, with `analysis: {watch: true}`: " + std::string(kind.watched);
}

std::string remedy_of(const AssumptionKind& kind, bool may_watch) {
  std::string result(kind.remedy);
  if (!may_watch || kind.watched.empty()) return result;
  if (!result.empty()) result += "; ";
  return result + "`analysis: {watch: true}`";
}

const AssumptionKind* assumption_kind(std::string_view id) noexcept {
  const auto* const found = std::find_if(kKinds.begin(), kKinds.end(),
                                         [&](const AssumptionKind& kind) { return kind.id == id; });
  return found != kKinds.end() ? found : nullptr;
}

}  // namespace takt
