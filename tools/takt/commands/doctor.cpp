// takt doctor: checks whether this machine is set up for real-time work.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"
#include "takt/sched/threads/thread_attributes.hpp"
#include "takt/transport/dds/participant.hpp"

#include "commands.hpp"
#include "doctor/rights.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "run/result_json.hpp"
#include "shell_word.hpp"

namespace takt::tools::doctor_command {
namespace {

namespace fs = std::filesystem;
using rt::read_line;

const char* word(Verdict verdict) {
  switch (verdict) {
    case Verdict::good:
      return "good";
    case Verdict::note:
      return "note";
    case Verdict::bad:
      return "BAD";
  }
  return "";
}

/// The selected word of "always [madvise] never".
std::string chosen(const std::string& line) {
  const auto open = line.find('['), close = line.find(']');
  return open == line.npos || close == line.npos ? line : line.substr(open + 1, close - open - 1);
}

// As Debian calls the processor that this program is for.
#if defined(__aarch64__)
constexpr const char* kRealTimeKernel = "apt-get install linux-image-rt-arm64";
#else
constexpr const char* kRealTimeKernel = "apt-get install linux-image-rt-amd64";
#endif

Finding preemption() {
  const std::string model = rt::preemption_model();
  const bool realtime = model == "PREEMPT_RT";
  return {"preemption model",
          "/sys/kernel/realtime, uname -v",
          model,
          realtime ? Verdict::good : Verdict::note,
          "without PREEMPT_RT an interrupt handler or a kernel lock can delay a thread for "
          "milliseconds",
          {kRealTimeKernel, "; reboot into it"}};
}

Finding throttling() {
  const std::string runtime = read_line("/proc/sys/kernel/sched_rt_runtime_us");
  const std::string period = read_line("/proc/sys/kernel/sched_rt_period_us");
  const bool off = runtime == "-1";
  return {"real-time throttling",
          "/proc/sys/kernel/sched_rt_runtime_us",
          off ? "off" : fmt::format("{} of {} µs", runtime, period),
          off ? Verdict::good : Verdict::note,
          "the kernel stops real-time threads that use more than this share; without throttling, a "
          "real-time thread that never sleeps blocks its CPU",
          {"sysctl -w kernel.sched_rt_runtime_us=-1", ""}};
}

/// The path of this process's cgroup for the controller, version 1 or 2; empty if there is none.
std::string cgroup_of(const std::string& controller) {
  std::ifstream file("/proc/self/cgroup");
  for (std::string line; std::getline(file, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == line.npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    if (controllers.find("," + controller + ",") != controllers.npos) {
      return "/sys/fs/cgroup/" + controller + line.substr(second + 1);
    }
    if (controllers == ",," && fs::exists("/sys/fs/cgroup/cgroup.controllers")) {
      return "/sys/fs/cgroup" + line.substr(second + 1);
    }
  }
  return {};
}

Finding cgroup_quota() {
  const std::string folder = cgroup_of("cpu");
  const std::string v2 = folder + "/cpu.max", v1 = folder + "/cpu.cfs_quota_us";
  std::string quota = read_line(v2);
  if (quota.empty()) quota = read_line(v1);
  const bool limited = !quota.empty() && !quota.starts_with("max") && quota != "-1";
  const std::string runtime = read_line(folder + "/cpu.rt_runtime_us");
  const bool no_runtime = runtime == "0";
  return {"cgroup CPU controller",
          folder.empty() ? "/proc/self/cgroup" : folder,
          folder.empty() ? "none"
                         : fmt::format("quota {}{}", quota.empty() ? "none" : quota,
                                       runtime.empty() ? "" : ", rt_runtime_us " + runtime),
          no_runtime ? Verdict::bad
          : limited  ? Verdict::note
                     : Verdict::good,
          "SCHED_OTHER threads stop when the quota is used up; with rt_runtime_us 0 the group "
          "cannot use SCHED_FIFO",
          // Another user may have made the path.
          {no_runtime ? fmt::format("echo 950000 > {}", shell_word(folder + "/cpu.rt_runtime_us"))
                      : fmt::format("echo {} > {}", fs::exists(v2) ? "max" : "-1",
                                    shell_word(fs::exists(v2) ? v2 : v1)),
           ""}};
}

Finding governor() {
  std::set<std::string> governors;
  for (const int cpu : available_cpus()) {
    const std::string name =
        read_line(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", cpu));
    if (!name.empty()) governors.insert(name);
  }
  const bool fast = governors.empty() || governors == std::set<std::string>{"performance"};
  return {"frequency governor",
          "/sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
          governors.empty() ? "none (the machine or its host decides)"
                            : fmt::format("{}", fmt::join(governors, ", ")),
          fast ? Verdict::good : Verdict::note,
          "an idle CPU starts at a low frequency, so execution times vary",
          {"cpupower frequency-set -g performance", ""}};
}

Finding idle_states() {
  std::string deepest;
  long latency_us = 0;
  std::error_code ignored;
  for (const auto& state :
       fs::directory_iterator("/sys/devices/system/cpu/cpu0/cpuidle", ignored)) {
    if (read_line(state.path() / "disable") == "1") continue;
    long latency = 0;
    std::istringstream(read_line(state.path() / "latency")) >> latency;
    if (latency >= latency_us) {
      latency_us = latency;
      deepest = read_line(state.path() / "name");
    }
  }
  return {"idle states",
          "/sys/devices/system/cpu/cpu0/cpuidle/*/latency",
          deepest.empty() ? "none visible (a virtual machine halts through its host)"
                          : fmt::format("deepest {}, {} µs to leave", deepest, latency_us),
          deepest.empty() || latency_us > 10 ? Verdict::note : Verdict::good,
          "the exit latency adds to every wake-up latency",
          {"",
           "write `cpu_dma_latency_us: 0` in the configuration file, or boot with "
           "processor.max_cstate=1"}};
}

Finding isolated_cpus() {
  const std::string isolated = read_line("/sys/devices/system/cpu/isolated");
  return {"isolated CPUs",
          "/sys/devices/system/cpu/isolated",
          isolated.empty() ? "none" : isolated,
          isolated.empty() ? Verdict::note : Verdict::good,
          "only threads with an explicit affinity run on an isolated CPU",
          {"", available_cpus().size() < 2
                   ? "not possible: there is only one CPU"
                   : fmt::format("boot with isolcpus={0} nohz_full={0} rcu_nocbs={0}",
                                 available_cpus().back())}};
}

Finding interrupts() {
  std::set<std::string> masks;
  std::size_t count = 0;
  std::error_code ignored;
  for (const auto& interrupt : fs::directory_iterator("/proc/irq", ignored)) {
    const std::string cpus = read_line(interrupt.path() / "smp_affinity_list");
    if (cpus.empty()) continue;
    masks.insert(cpus);
    ++count;
  }
  const std::string all = read_line("/sys/devices/system/cpu/online");
  const bool anywhere = masks.count(all) != 0;
  return {"interrupt affinity",
          "/proc/irq/*/smp_affinity_list",
          fmt::format("{} interrupts on {}", count, fmt::join(masks, " | ")),
          anywhere ? Verdict::note : Verdict::good,
          "an interrupt on the CPU of a real-time thread delays it",
          {"", "echo 0 > /proc/irq/N/smp_affinity_list for each, and boot with irqaffinity=0"}};
}

Finding huge_pages() {
  const std::string mode = chosen(read_line("/sys/kernel/mm/transparent_hugepage/enabled"));
  return {"transparent huge pages",
          "/sys/kernel/mm/transparent_hugepage/enabled",
          mode.empty() ? "not available" : mode,
          mode == "always" ? Verdict::note : Verdict::good,
          "the kernel compacts memory in the background, and threads wait for it",
          {"echo madvise > /sys/kernel/mm/transparent_hugepage/enabled", ""}};
}

Finding swap() {
  std::ifstream file("/proc/swaps");
  std::string line;
  std::getline(file, line);  // the header
  int areas = 0;
  while (std::getline(file, line)) ++areas;
  return {"swap",
          "/proc/swaps",
          areas == 0 ? "none" : fmt::format("{} areas", areas),
          areas == 0 ? Verdict::good : Verdict::note,
          "unlocked memory may be swapped to disk",
          {"swapoff -a", ", or write `memory: {lock: true}` in the configuration file"}};
}

Finding clock_source() {
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  const std::string source = read_line(folder + "current_clocksource");
  static const std::set<std::string> quick{"tsc", "kvm-clock", "arch_sys_counter",
                                           "hyperv_clocksource_tsc_page"};
  return {"clock source",
          folder + "current_clocksource",
          source,
          quick.count(source) != 0 ? Verdict::good : Verdict::bad,
          "other sources need a system call for each reading, some a microsecond; Takt reads the "
          "clock at every callback",
          {fmt::format("echo tsc > {}current_clocksource", folder),
           fmt::format(" (offered: {})", read_line(folder + "available_clocksource"))}};
}

Finding timer_slack() {
  const int slack_ns = prctl(PR_GET_TIMERSLACK);
  return {
      "timer slack",
      "prctl(2) PR_GET_TIMERSLACK",
      to_string(Nanoseconds(slack_ns)),
      slack_ns > 50'000 ? Verdict::note : Verdict::good,
      "SCHED_OTHER threads of other code may wake up this much later; real-time threads have no "
      "slack, and the threads of Takt's executors give themselves 1 ns",
      {"", "run the thread under SCHED_FIFO"}};
}

Finding io_uring() {
  const std::string disabled = read_line("/proc/sys/kernel/io_uring_disabled");
  const bool off = !disabled.empty() && disabled != "0";
  return {"io_uring",
          "/proc/sys/kernel/io_uring_disabled",
          disabled.empty() ? "enabled (this kernel has no switch)"
          : off            ? "disabled (" + disabled + ")"
                           : "enabled",
          off ? Verdict::note : Verdict::good,
          "`wait: io_uring` needs it",
          {"sysctl -w kernel.io_uring_disabled=0", ""}};
}

Finding multicast() {
  const std::string flags = read_line("/sys/class/net/lo/flags");
  unsigned long bits = 0;
  std::istringstream(flags) >> std::hex >> bits;
  const bool up = (bits & 1) != 0;
  return {"loopback interface",
          "/sys/class/net/lo/flags",
          up ? "up" : "down",
          up ? Verdict::good : Verdict::bad,
          "Cyclone DDS discovers processes on the same machine through it",
          {"ip link set lo up", ""}};
}

Finding receive_buffer() {
  long bytes = 0;
  std::istringstream(read_line("/proc/sys/net/core/rmem_max")) >> bytes;
  const bool enough = bytes >= 4'194'304;
  return {
      "socket receive buffer",
      "/proc/sys/net/core/rmem_max",
      fmt::format("{} KiB", bytes / 1024),
      enough ? Verdict::good : Verdict::note,
      "large messages (above about 100 KB) between processes lose fragments, and are sent again",
      {"sysctl -w net.core.rmem_max=8388608", ""}};
}

Finding domain_participant() {
  std::string found = "a participant can be created";
  Verdict verdict = Verdict::good;
  try {
    Participant::create({});
  } catch (const std::exception& error) {
    found = error.what();
    verdict = Verdict::bad;
  }
  return {"Cyclone DDS",
          "dds_create_participant(3)",
          found,
          verdict,
          "processes communicate through it",
          {"", "see ROS_DOMAIN_ID and the loopback interface"}};
}

Finding shared_memory() {
  std::error_code failed;
  const fs::space_info space = fs::space("/dev/shm", failed);
  const bool enough = !failed && space.available > (std::uintmax_t{64} << 20);
  const Roudi roudi = find_roudi();
  return {"shared memory, RouDi",
          "/dev/shm, /proc/locks, /tmp/roudi",
          failed ? "no /dev/shm"
                 : fmt::format("{} MiB free; {}", space.available >> 20,
                               roudi.unusable.empty()
                                   ? fmt::format("RouDi takes messages up to {} bytes",
                                                 roudi.largest_message)
                               : RoudiProcess::is_installed() ? roudi.unusable
                                                              : "iox-roudi is not installed"),
          enough ? Verdict::good : Verdict::note,
          "it carries messages of fixed size between processes without a copy",
          {"mount -o remount,size=1G /dev/shm", ""}};
}

Finding neighbours() {
  const rt::Observation observation;
  usleep(200'000);
  const rt::Observation::Result result = observation.so_far();
  std::vector<std::string> names;
  for (const rt::Neighbour& neighbour : result.neighbours) {
    names.push_back(
        fmt::format("{} ({} {})", neighbour.name, neighbour.policy, neighbour.priority));
  }
  return {"other real-time threads",
          "/proc/*/task/*/schedstat, for 0.2 s",
          names.empty() ? "none ran" : fmt::format("{}", fmt::join(names, ", ")),
          names.empty() ? Verdict::good : Verdict::note,
          "a thread with a higher priority on the same CPU delays Takt's threads",
          {"", "give Takt's threads higher priorities, or other CPUs"}};
}

std::string text_of(const Fix& fix) {
  return fix.commands + fix.rest;
}

void write(const std::vector<Finding>& findings, const std::string& json_file) {
  nlohmann::json list = nlohmann::json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"what", finding.what},
                    {"found", finding.found},
                    {"verdict", finding.verdict == Verdict::bad ? "bad" : word(finding.verdict)},
                    {"why", finding.why},
                    {"fix", finding.verdict == Verdict::good ? "" : text_of(finding.fix)},
                    {"source", finding.source}});
  }
  write_json({{"takt", {{"version", TAKT_VERSION}}},
              {"machine", rt::machine_json()},
              {"findings", std::move(list)}},
             json_file);
}

/// What is good needs no line. What a shell cannot do is a comment.
void print_script(const std::vector<Finding>& findings) {
  rt::print("#!/bin/sh\n# What takt doctor has found to be missing, for root's shell.\n");
  for (const Finding& finding : findings) {
    if (finding.verdict == Verdict::good) continue;
    rt::print("\n# {}: {}\n", finding.what, finding.why);
    const Fix& fix = finding.fix;
    if (fix.commands.empty()) {
      rt::print("# by hand: {}\n", fix.rest);
    } else {
      const std::size_t rest = std::min(fix.rest.find_first_not_of(" ,;"), fix.rest.size());
      rt::print("{}{}{}\n", fix.commands, fix.rest.empty() ? "" : "  # ", fix.rest.substr(rest));
    }
  }
}

void print_table(const std::vector<Finding>& findings) {
  std::size_t width = 0;
  for (const Finding& finding : findings) width = std::max(width, finding.what.size());
  std::array<int, 3> counts{};
  for (const Finding& finding : findings) {
    ++counts[static_cast<std::size_t>(finding.verdict)];
    rt::print("{:<5} {:<{}}  {}\n", word(finding.verdict), finding.what, width, finding.found);
    if (finding.verdict == Verdict::good) continue;
    rt::print("      {:<{}}  why:  {}\n", "", width, finding.why);
    rt::print("      {:<{}}  fix:  {}\n", "", width, text_of(finding.fix));
    rt::print("      {:<{}}  from: {}\n", "", width, finding.source);
  }
  rt::print("\n{} good, {} notes, {} bad\n", counts[0], counts[1], counts[2]);
}

void doctor(const std::string& json_file, bool is_script) {
  const std::vector<Finding> findings{
      realtime_policy(),    reservations(), locked_memory(), nice_limit(),  preemption(),
      throttling(),         cgroup_quota(), governor(),      idle_states(), dma_latency(),
      isolated_cpus(),      interrupts(),   huge_pages(),    swap(),        clock_source(),
      timer_slack(),        io_uring(),     neighbours(),    multicast(),   receive_buffer(),
      domain_participant(), shared_memory()};
  if (is_script) {
    print_script(findings);
  } else if (json_file != "-") {
    print_table(findings);
  }
  const bool is_bad = std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::bad;
  });
  if (!json_file.empty()) write(findings, json_file);
  if (is_bad) throw CLI::RuntimeError(kFailed);
}

void set_up(CLI::App* command) {
  const auto json = std::make_shared<std::string>();
  const auto is_script = std::make_shared<bool>(false);
  CLI::Option* const to_json =
      add_output(*command, "--json", *json, "Write the findings as JSON too; - for stdout");
  command
      ->add_flag("--script", *is_script,
                 "Instead: print what root's shell does about what is not good")
      ->excludes(to_json);
  command->footer(
      "Examples:\n"
      "  takt doctor --json doctor.json\n"
      "  takt doctor --script > remedies.sh\n");
  command->callback([json, is_script] { doctor(*json, *is_script); });
}
const Command registered(
    "doctor", "Checks whether this machine is set up for real-time work, and how to fix it",
    set_up);

}  // namespace
}  // namespace takt::tools::doctor_command
