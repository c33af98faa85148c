// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/machine.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

namespace takt::rt {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

/// The counters in line "cpu" of /proc/stat, in ticks; the eighth is steal.
std::vector<std::uint64_t> cpu_ticks() {
  std::istringstream line(read_line("/proc/stat"));
  std::string word;
  line >> word;
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick; line >> tick;) ticks.push_back(tick);
  ticks.resize(10);
  return ticks;
}

const char* realtime_policy(int policy) {
  switch (policy & ~SCHED_RESET_ON_FORK) {
    case SCHED_FIFO:
      return "SCHED_FIFO";
    case SCHED_RR:
      return "SCHED_RR";
    case SCHED_DEADLINE:
      return "SCHED_DEADLINE";
    default:
      return nullptr;
  }
}

enum class Of { others, this_process };

/// All real-time threads of other processes, of the kernel only those that serve interrupts, or of
/// this one, by thread id.
std::map<int, Neighbour> realtime_threads(Of whose = Of::others) {
  std::map<int, Neighbour> result;
  std::error_code ignored;  // processes may end during the iteration
  for (const auto& process : fs::directory_iterator("/proc", ignored)) {
    const std::string name = process.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if ((std::stoi(name) == getpid()) != (whose == Of::this_process)) continue;
    if (read_line(process.path() / "cmdline").empty() &&
        !read_line(process.path() / "comm").starts_with("irq/")) {
      continue;
    }
    for (const auto& task : fs::directory_iterator(process.path() / "task", ignored)) {
      Neighbour neighbour{.process = std::stoi(name),
                          .thread = std::stoi(task.path().filename().string())};
      const char* policy = realtime_policy(sched_getscheduler(neighbour.thread));
      if (policy == nullptr) continue;
      neighbour.policy = policy;
      neighbour.name = read_line(task.path() / "comm");
      sched_param parameters{};
      sched_getparam(neighbour.thread, &parameters);
      neighbour.priority = parameters.sched_priority;
      cpu_set_t cpus;
      CPU_ZERO(&cpus);
      sched_getaffinity(neighbour.thread, sizeof cpus, &cpus);
      for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        if (CPU_ISSET(cpu, &cpus)) neighbour.affinity.push_back(cpu);
      }
      std::int64_t run_ns = 0;
      std::istringstream(read_line(task.path() / "schedstat")) >> run_ns;
      neighbour.cpu_time = Nanoseconds(run_ns);
      result.emplace(neighbour.thread, std::move(neighbour));
    }
  }
  return result;
}

std::vector<Neighbour> listed(const std::map<int, Neighbour>& threads) {
  std::vector<Neighbour> result;
  for (const auto& [number, thread] : threads) result.push_back(thread);
  return result;
}

}  // namespace

std::string read_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::string preemption_model() {
  utsname name{};
  uname(&name);
  const std::string version = name.version;
  if (read_line("/sys/kernel/realtime") == "1" || version.find("PREEMPT_RT") != version.npos) {
    return "PREEMPT_RT";
  }
  // "none voluntary (full)": the present model is in brackets.
  const std::string choice = read_line("/sys/kernel/debug/sched/preempt");
  const auto open = choice.find('('), close = choice.find(')');
  if (open != choice.npos && close != choice.npos) {
    return fmt::format("PREEMPT_DYNAMIC ({})", choice.substr(open + 1, close - open - 1));
  }
  for (const char* model : {"PREEMPT_DYNAMIC", "PREEMPT"}) {
    if (version.find(model) != version.npos) return model;
  }
  return "none or voluntary";
}

json machine_json() {
  utsname name{};
  uname(&name);
  double load = 0;
  std::istringstream(read_line("/proc/loadavg")) >> load;
  return {{"cpu", cpu_model()},
          {"cpus", std::thread::hardware_concurrency()},
          {"kernel", name.release},
          {"kernel_version", name.version},
          {"preemption", preemption_model()},
          {"architecture", name.machine},
          {"load_average", load},
          {"compiler", __VERSION__}};
}

void stay_on(std::size_t cpu) {
  if (cpu < available_cpus().size()) apply({.affinity = {available_cpus()[cpu]}}, Realtime::off);
}

std::string machine_line() {
  const json machine = machine_json();
  return fmt::format("{} x {}, Linux {}, {}, load average {:.2f}", machine.at("cpus").get<int>(),
                     machine.at("cpu").get<std::string>(), machine.at("kernel").get<std::string>(),
                     machine.at("preemption").get<std::string>(),
                     machine.at("load_average").get<double>());
}

std::string lasting_part(const std::string& machine_line) {
  return machine_line.substr(0, machine_line.find(", load average"));
}

std::vector<Neighbour> realtime_neighbours() {
  return listed(realtime_threads());
}

std::vector<Neighbour> own_realtime_threads() {
  return listed(realtime_threads(Of::this_process));
}

bool is_virtual() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("flags") && line.find(" hypervisor") != std::string::npos) return true;
  }
  return !read_line("/sys/hypervisor/type").empty();
}

Observation::Observation() : before_(realtime_threads()), cpu_before_(cpu_ticks()) {
}

Observation::Result Observation::so_far() const {
  Result result;
  for (auto& [thread, neighbour] : realtime_threads()) {
    if (const auto earlier = before_.find(thread); earlier != before_.end()) {
      neighbour.cpu_time -= earlier->second.cpu_time;
    }
    if (neighbour.cpu_time > Nanoseconds::zero()) result.neighbours.push_back(neighbour);
  }
  std::sort(result.neighbours.begin(), result.neighbours.end(),
            [](const auto& a, const auto& b) { return a.cpu_time > b.cpu_time; });
  const std::vector<std::uint64_t> now = cpu_ticks();
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < 8; ++i) all += now[i] - cpu_before_[i];
  if (all != 0) {
    result.steal_percent =
        100.0 * static_cast<double>(now[7] - cpu_before_[7]) / static_cast<double>(all);
  }
  std::istringstream(read_line("/proc/loadavg")) >> result.load_average;
  return result;
}

json to_json(const Observation::Result& result) {
  json neighbours = json::array();
  for (const Neighbour& neighbour : result.neighbours) {
    neighbours.push_back({{"process", neighbour.process},
                          {"thread", neighbour.thread},
                          {"name", neighbour.name},
                          {"policy", neighbour.policy},
                          {"priority", neighbour.priority},
                          {"affinity", neighbour.affinity},
                          {"cpu_ms", static_cast<double>(neighbour.cpu_time.count()) / 1e6}});
  }
  return {{"realtime_neighbours", std::move(neighbours)},
          {"steal_percent", result.steal_percent},
          {"load_average", result.load_average}};
}

}  // namespace takt::rt
