// The configuration file: its keys, and what is checked about them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/duration.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/parameter_service.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/sched/scheduler_library.hpp"

namespace takt {
namespace {

template <class T>
std::optional<T> item_of(const document::Value& value) {
  if (const T* content = std::get_if<T>(&value.content)) return *content;
  if constexpr (std::is_same_v<T, double>) {  // among other numbers, 1 is 1.0
    if (const auto integer = item_of<std::int64_t>(value)) return static_cast<double>(*integer);
  }
  return {};
}

// The list as an array of T, if all of it is.
template <class T>
std::optional<ParameterValue> array_of(const document::List& list) {
  std::vector<T> result;
  for (const document::Value& value : list) {
    const std::optional<T> item = item_of<T>(value);
    if (!item) return {};
    result.push_back(*item);
  }
  return result;
}

bool is_empty_list(const document::Value* value) {
  const auto* list = value != nullptr ? std::get_if<document::List>(&value->content) : nullptr;
  return list != nullptr && list->empty();
}

class ConfigurationReader : private SystemReader {
 public:
  explicit ConfigurationReader(document::Errors& errors) : SystemReader(errors) {}

  std::map<std::string, CallbackParameterChanges> read_changes(const Value& root) {
    std::map<std::string, CallbackParameterChanges> changes;
    each_in_map([&](const Value& node) { read_changes(node, changes[node.name]); })(root);
    return changes;
  }

  ComponentDescription read_one(const Value& component, const std::vector<std::string>& executors,
                                const LoadPolicy& policy) {
    executors_ = {executors.begin(), executors.end()};
    policy_ = &policy;
    read_component(component);
    return system_.components.empty() ? ComponentDescription{} : system_.components.front();
  }

  std::vector<ReferenceSection> describe_file() {
    return describe([this](const Value& root) { read_file(root); });
  }

  SystemDescription read(const Value& root) {
    read_file(root);
    check_number_of_containers(root);
    check_that_loading_can_be_asked_for(root);
    if (const Value* executors = document::find(root, "executors"); executors != nullptr) {
      errors_.passes(executors->line, [this] { check_admission(executors_threads_); });
    }
    return std::move(system_);
  }

  std::optional<ParameterValue> parameter_value(const Value& value) {
    if (describes("`true` or `false`, integer, number, text, a list of one of these that is not "
                  "empty, or a map of them")) {
      return {};
    }
    if (const auto* list = std::get_if<document::List>(&value.content)) {
      std::optional<ParameterValue> array = array_of<bool>(*list);
      if (!array) array = array_of<std::int64_t>(*list);
      if (!array) array = array_of<double>(*list);
      if (!array) array = array_of<std::string>(*list);
      if (array && !list->empty()) return array;
      refuse(value, list->empty() ? "at least one item, which tells the type"
                                  : "items of one type: numbers, texts, or true and false");
      return {};
    }
    const auto take = [](const auto& content) -> std::optional<ParameterValue> {
      if constexpr (std::is_constructible_v<ParameterValue, decltype(content)>) return content;
      return {};
    };
    std::optional<ParameterValue> result = std::visit(take, value.content);
    if (!result) refuse(value, "a value, or leave it out");
    return result;
  }

 private:
  void read_file(const Value& root) {
    read_map(
        root, "the file",
        {{"realtime",
          "What to do when the system refuses rights. `require`: an error. `prefer`: go on, and "
          "say so in the notes. `off`: threads ask for nothing but name and CPUs, and memory is "
          "not locked.",
          into(system_.realtime, {{"require", Realtime::require},
                                  {"prefer", Realtime::prefer},
                                  {"off", Realtime::off}})},
         {"memory", "What is kept in memory.",
          [this](const Value& memory) { read_memory(memory); }},
         {"cpu_dma_latency_us",
          "Holds `/dev/cpu_dma_latency` open with this value while the container lives. Without "
          "it, the device is left alone.",
          into(system_.cpu_dma_latency_us, 0)},
         {"threads", "Descriptions of threads by name, for executors and DDS.",
          each_in_map([this](const Value& thread) { read_thread(thread); })},
         {"dds", "Joins a DDS domain.", [this](const Value& dds) { read_dds(dds); }},
         {"topics",
          "What holds for both ends of a topic instead of what the code says, by the topic's full "
          "name.",
          each_in_map([this](const Value& topic) { read_topic(topic); })},
         {"schedulers", "Schedulers that are not Takt's, by the name that their library registers.",
          each_in_map([this](const Value& scheduler) { read_scheduler(scheduler); })},
         {"executors", "Executors by name.",
          each_in_map([this](const Value& executor) { read_executor(executor); })},
         {"container", "The only container. This key or `containers` is needed.",
          [this](const Value& container) { system_.name = read_container(container); }},
         {"containers", "Each is a process of its own, and needs its own `name`.",
          [this](const Value& containers) { read_containers(containers); }},
         {"lifecycle", "Lifecycle nodes that are brought up together.",
          [this](const Value& lifecycle) { read_lifecycle(lifecycle); }},
         {"chains",
          "Ways of messages from callback to callback, measured from end to end. `auto`: every "
          "way from a timer to where nothing follows is a chain, of which the one with the "
          "shorter period is the more critical.",
          [this](const Value& chains) { read_chains(chains); }}});
  }

  void read_memory(const Value& memory) {
    read_map(
        memory, "memory",
        {{"lock",
          "Locks all present and future pages (mlockall), and tells malloc to keep what it has.",
          into(system_.lock_memory)}});
  }

  // Notes in `is_sound` when the reading adds an error.
  Read noting(bool& is_sound, Read read) {
    return [this, &is_sound, read = std::move(read)](const Value& value) {
      const std::size_t before = errors_.size();
      read(value);
      is_sound &= errors_.size() == before;
    };
  }

  // ---- Threads ----

  void read_thread(const Value& value) {
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
  bool passes(const Value& thread, std::string_view key, const std::function<void()>& check) {
    const Value* place = document::find(thread, key);
    return errors_.passes((place != nullptr ? *place : thread).line, check);
  }

  Read into_policy(ThreadPolicy& policy) {
    Words<ThreadPolicy> policies;
    for (const ThreadPolicy known :
         {ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr, ThreadPolicy::batch,
          ThreadPolicy::idle, ThreadPolicy::deadline}) {
      policies.emplace_back(to_string(known), known);
    }
    return into(policy, std::move(policies));
  }

  void read_cpu(const Value& value, std::vector<int>& cpus) {
    if (describes("integer from 0")) return;
    int cpu = -1;
    into(cpu, 0)(value);
    if (cpu < 0) return;
    if (errors_.passes(value.line, [&] { ThreadAttributes{.affinity = {cpu}}.check(); })) {
      cpus.push_back(cpu);
    }
  }

  void read_dds(const Value& value) {
    DdsOptions& dds = system_.dds.emplace();
    std::string threads;
    read_map(
        value, "dds",
        {{"domain",
          "Only processes of one domain see each other. Without it, that of the environment "
          "variable `ROS_DOMAIN_ID`, else 0.",
          into_domain(dds.domain)},
         {"loopback_only",
          "Talk over the loopback interface only; what comes by another is dropped. Without it, "
          "Cyclone's sockets receive from all interfaces.",
          into(dds.loopback_only)},
         {"parameter_services", "Containers answer ROS 2's parameter services: six for each node.",
          into(dds.parameter_services)},
         {"ros_graph",
          "In whose form ROS 2 is told of the nodes here: `jazzy` (since Iron) or `humble` (and "
          "before). `off`: others see topics and services, but no nodes.",
          into(dds.ros_graph,
               {{"jazzy", RosGraph::jazzy}, {"humble", RosGraph::humble}, {"off", RosGraph::off}})},
         {"rosout", "What is logged goes to ROS 2's topic `/rosout` too.", into(dds.rosout)},
         {"shared_memory",
          "Whether messages of fixed size go to other processes by shared memory. `auto`: when an "
          "iox-roudi runs that this user can use, else by UDP. `require`: `takt run` starts one "
          "when none runs, and what cannot be had is an error. See "
          "[zero copy](../how_to/zero_copy.md).",
          into(dds.shared_memory, {{"auto", SharedMemory::automatic},
                                   {"require", SharedMemory::require},
                                   {"off", SharedMemory::off}})},
         {"synchronized_clocks",
          "Other hosts keep the same time as this one, by PTP: latencies and deadlines of their "
          "messages begin when they were sent. Otherwise they begin on arrival.",
          into(dds.synchronized_clocks)},
         {"threads",
          "Name in `threads`: policy, priority and CPUs of all of Cyclone's threads; without it, "
          "SCHED_OTHER. They keep Cyclone's names; the result shows what is in force. Not "
          "SCHED_DEADLINE, which they cannot inherit.",
          [&](const Value& name) {
            into(threads)(name);
            if (!threads.empty()) dds.threads = find_thread(name.line, threads);
            errors_.passes(name.line, [&] { dds.check(); });
          }},
         {"security",
          "DDS Security: who this process is, what it may do, and what is encrypted. Without it, "
          "whoever is on the domain may read and write everything.",
          [&](const Value& security) { read_security(security, dds.security.emplace()); }}});
  }

  void read_security(const Value& value, DdsSecurity& security) {
    const PemFile certificate{"BEGIN CERTIFICATE", "a certificate in PEM form"};
    const PemFile key{"PRIVATE KEY", "a private key in PEM form, without a password"};
    const PemFile document{"multipart/signed", "a document that `openssl smime -sign` has signed"};
    read_map(
        value, "security",
        {{"identity_ca", "The certificate of who has signed those of all processes.",
          into_file(security.identity_ca, certificate), true},
         {"certificate", "That of this process.", into_file(security.certificate, certificate),
          true},
         {"private_key", "Of that certificate, without a password, and not for every user to read.",
          into_file(security.private_key, key), true},
         {"permissions_ca",
          "The certificate of who has signed the next two. Without it, `identity_ca`.",
          into_file(security.permissions_ca, certificate)},
         {"governance", "What is protected, and how: the same for all of a domain. Signed.",
          into_file(security.governance, document), true},
         {"permissions",
          "What may be written and read by whom, told by the subject of the certificate. "
          "Signed.",
          into_file(security.permissions, document), true}});
    if (security.permissions_ca.empty()) security.permissions_ca = security.identity_ca;
    if (!security.certificate.empty() && !security.private_key.empty()) {
      passes(value, "private_key", [&] { security.check(); });
    }
  }

  // Cyclone refuses a wrong one too, but does not tell which.
  struct PemFile {
    std::string_view mark, kind;
  };

  // A file of this kind; a relative path begins in the folder of this file.
  Read into_file(std::string& path, PemFile wanted) {
    return into_checked(path, [this, &path, wanted] {
      const std::string file = beside(path);
      std::error_code none;
      std::ifstream stream;
      if (std::filesystem::is_regular_file(file, none)) stream.open(file, std::ios::binary);
      if (!stream.is_open()) {
        throw Error(fmt::format("there is no file '{}' that can be read", path),
                    fmt::format("name {}", wanted.kind));
      }
      std::string begin(1 << 16, '\0');
      stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
      if (begin.find(wanted.mark) == std::string::npos) {
        throw Error(fmt::format("there is no '{}' in '{}'", wanted.mark, path),
                    fmt::format("name {}", wanted.kind));
      }
      path = file;
    });
  }

  // Its default is the environment's, which is no part of the reference.
  Read into_domain(int& domain) {
    return without_default([this, &domain] { return into(domain, 0, 230); });
  }

  // ---- Topics ----

  void read_topic(const Value& value) {
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
          into(qos.durability,
               Words<Durability>{{"volatile", Durability::volatile_},
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
          into(qos.liveliness,
               Words<Liveliness>{{"automatic", Liveliness::automatic},
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

  // ---- Schedulers ----

  void read_scheduler(const Value& value) {
    const auto load = [&](const Value& place) {
      std::string library;
      read_library(place, library);
      if (library.empty()) return;
      if (!errors_.passes(place.line, [&] { load_scheduler(value.name, library); })) {
        broken_schedulers_.insert(value.name);
      }
    };
    read_map(
        value, "a scheduler",
        {{"library",
          "A shared library. With a slash: a path, from the folder of this file if it is "
          "relative. Without one: a file beside this file, or else a library of the system, as "
          "the dynamic linker finds it.",
          load, true}});
  }

  Read into_scheduler(std::string& target) {
    return into_checked(target, [this, &target] {
      if (broken_schedulers_.contains(target)) return target.clear();  // an error has told
      schedulers().check(target);
    });
  }

  // ---- Executors ----

  void read_executor(const Value& value) {
    ExecutorDescription executor;
    executor.name = value.name;
    executor.where = errors_.where(value.line);
    ExecutorOptions options{.name = value.name};
    bool is_sound = true;
    read_map(
        value, "an executor",
        {{"type", "See `takt list executors`.",
          noting(is_sound, into_checked(executor.type, [&] { executors().check(executor.type); }))},
         {"scheduler",
          "See `takt list schedulers`, or a name in `schedulers`. Without it, the type's own.",
          noting(is_sound, into_scheduler(executor.scheduler))},
         {"wait",
          "How its threads sleep: `auto`, or see `takt list wait_backends`. `auto`: `futex`, or "
          "`epoll` if there are file descriptors when it first spins. `futex` serves no file "
          "descriptors, and `io_uring` one thread only: both are refused where they cannot serve.",
          noting(is_sound,
                 into_checked(executor.wait, [&] { check_wait_backend(executor.wait); }))},
         {"early_wake",
          "Up to `1ms`. A thread that sleeps until a timer wakes so much earlier and looks at the "
          "clock until the release: no wake-up latency, for that much of a CPU at each sleep.",
          into_duration(executor.early_wake, [] {})},
         {"per",
          "For `isolated`: what gets an executor and a thread of its own. With `group`, the "
          "thread of a callback group takes over its parameters: the priority if its policy is "
          "SCHED_FIFO or SCHED_RR; budget, deadline and period if it is SCHED_DEADLINE.",
          into(executor.per, {{"node", Isolation::node}, {"group", Isolation::group}})},
         {"trigger", "For `triggered`: when what is ready is served.",
          noting(is_sound, into_trigger(executor.trigger))},
         {"let", "For `triggered`: the period of its logical execution time; not 0.",
          into_duration(executor.trigger.let_period,
                        [&] {
                          if (executor.trigger.let_period != Nanoseconds::zero()) return;
                          throw Error("a period of 0 cannot be kept",
                                      "leave it out, or give it time");
                        })},
         {"order",
          "`node/callback`: those that come first in the order of registration, for the "
          "schedulers `listed` and, inside a kind, `ros`.",
          each_in_list(
              [&](const Value& callback) { into(executor.order.emplace_back())(callback); })},
         {"threads",
          "Names in `threads`, one for each thread of the executor. Without them, the type's own. "
          "More than the type takes are an error.",
          each_in_list([&](const Value& thread) {
            std::string name;
            into(name)(thread);
            if (name.empty()) return;
            executor.threads.push_back(name);
            options.threads.push_back(find_thread(thread.line, name));
            executors_threads_.push_back(options.threads.back());
          })}});
    options.scheduler = executor.scheduler;
    options.wait = executor.wait;
    options.early_wake = executor.early_wake;
    options.per = executor.per;
    options.trigger = executor.trigger;
    // Only the type itself knows how many threads it can take, and the wait back end whether it
    // serves so many. Making them starts none.
    if (is_sound) errors_.passes(value.line, [&] { executors().make(executor.type, options); });
    executors_.insert(executor.name);
    system_.executors.push_back(std::move(executor));
  }

  Read into_trigger(TriggerOptions& trigger) {
    const Read word = into(
        trigger.kind, {{"any", TriggerOptions::Kind::any}, {"all", TriggerOptions::Kind::all}});
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
                   {{"one", "`node/callback`: when this one is ready.", into(trigger.one), true}});
        });
  }

  // The attributes of what is called so; those of a plain thread, and an error, when nothing is.
  ThreadAttributes find_thread(int line, const std::string& name) {
    if (const auto found = threads_.find(name); found != threads_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& [known, attributes] : threads_) names.push_back(known);
    errors_.add(line, fmt::format("no thread is called '{}'", name),
                names.empty() ? "describe it under 'threads'" : suggest(name, names));
    return {};
  }

  Read into_executor(std::string& target) {
    return into_checked(target, [this, &target] {
      if (executors_.contains(target)) return;
      throw Error(fmt::format("no executor is called '{}'", target),
                  suggest(target, std::vector(executors_.begin(), executors_.end())));
    });
  }

  // ---- Containers ----

  void read_containers(const Value& value) {
    std::map<std::string, int> lines;
    each_in_list([&](const Value& container) {
      const std::string name = read_container(container);
      if (lines.empty()) system_.name = name;
      const auto [known, is_new] = lines.try_emplace(name, container.line);
      if (is_new) return;
      errors_.add(container.line,
                  fmt::format("the container of line {} is called '{}' too", known->second, name),
                  "give each its own 'name'");
    })(value);
    if (lines.empty() && std::holds_alternative<document::List>(value.content)) {
      errors_.add(value.line, "the list of containers is empty", "describe one");
    }
  }

  void check_number_of_containers(const Value& root) {
    if (!std::holds_alternative<document::Map>(root.content)) return;
    const Value* one = document::find(root, "container");
    const Value* several = document::find(root, "containers");
    if (one == nullptr && several == nullptr) {
      errors_.add(root.line, "the file describes no container",
                  "add the key 'containers' with a list of components");
    } else if (one != nullptr && several != nullptr) {
      errors_.add(std::max(one->line, several->line),
                  "the file has both 'container' and 'containers'", "leave out one of the two");
    }
  }

  void check_that_loading_can_be_asked_for(const Value& root) {
    const Value* only = document::find(root, "container");
    if (const Value* several = document::find(root, "containers")) {
      const auto* list = std::get_if<document::List>(&several->content);
      only = list != nullptr && list->size() == 1 ? &list->front() : nullptr;
    }
    const Value* load = only != nullptr ? document::find(*only, "load") : nullptr;
    if (load == nullptr || document::find(root, "dds") != nullptr) return;
    errors_.add(load->line, "nobody can ask a container to load anything that is not on DDS",
                "leave out 'load', or add the key 'dds'");
  }

  std::string read_container(const Value& value) {
    const std::size_t before = system_.components.size();
    const Value* place = document::find(value, "components");
    std::string name = "takt";
    RestartOptions restart;
    LoadPolicy load;
    read_map(
        value, "a container",
        {{"name", "The process in results.", into(name)},
         {"restart", "When its process is started again after its end.", into_restart(restart)},
         {"load",
          "Which libraries it loads when it is asked to while it runs, by `takt component load` or "
          "ROS 2. `off`: none, and no component either. `index`: those that the component index "
          "and the keys `library` of this file name. `any`: every file, for everybody on the "
          "domain. See [security](../explanation/security.md).",
          into_load(load)},
         {"components", "Not empty.",
          each_in_list([this](const Value& item) { read_component(item); }), true}});
    if (place != nullptr && std::holds_alternative<document::List>(place->content) &&
        system_.components.size() == before) {
      errors_.add(place->line, fmt::format("the container '{}' is empty", name),
                  "list at least one component");
    }
    for (std::size_t i = before; i < system_.components.size(); ++i) {
      system_.components[i].container = name;
    }
    if (restart.policy != RestartOptions::Policy::never) system_.restarts[name] = restart;
    system_.loads[name] = load;
    return name;
  }

  Read into_load(LoadPolicy& load) {
    const Read word = into(load.kind, {{"off", LoadPolicy::Kind::off},
                                       {"index", LoadPolicy::Kind::index},
                                       {"any", LoadPolicy::Kind::any}});
    return either(word, [this, &load](const Value& value) {
      read_map(value, "a load policy",
               {{"libraries",
                 "Folders: with `index`, the libraries in them and below. A relative path begins "
                 "in the folder of this file.",
                 each_in_list([this, &load](const Value& folder) { read_folder(folder, load); }),
                 true}});
      const Value* libraries = document::find(value, "libraries");
      if (is_empty_list(libraries)) {
        errors_.add(libraries->line, "the list of folders is empty",
                    "name a folder, or write `load: index`");
      }
    });
  }

  void read_folder(const Value& value, LoadPolicy& load) {
    std::string folder;
    into_checked(folder, [&] { load.folders.push_back(real_folder(beside(folder))); })(value);
  }

  Read into_restart(RestartOptions& restart) {
    const Read policy = into(restart.policy, {{"never", RestartOptions::Policy::never},
                                              {"on_failure", RestartOptions::Policy::on_failure},
                                              {"always", RestartOptions::Policy::always}});
    return either(policy, [this, policy, &restart](const Value& value) {
      read_map(value, "a restart",
               {{"policy", "Never, after a failure, or after every end.", policy, true},
                {"delay", "How long after the end.", into_duration(restart.delay, [] {})},
                {"most", "How often in one run.", into(restart.most, 1)}});
    });
  }

  // ---- Lifecycle ----

  void read_lifecycle(const Value& value) {
    LifecycleDescription& lifecycle = system_.lifecycle.emplace();
    lifecycle.where = errors_.where(value.line);
    read_map(
        value, "the lifecycle",
        {{"bring_up", "Nodes by their full names, in the order in which they come up.",
          each_in_list([&](const Value& node) {
            const std::string name = find_node(node);
            if (name.empty()) return;
            if (find_managed(lifecycle, name) != nullptr) {
              errors_.add(node.line, fmt::format("'{}' is brought up twice", name),
                          "list every node once");
            } else {
              lifecycle.bring_up.push_back({name, {}});
            }
          }),
          true},
         {"depends_on",
          "By the name of a node, those that are active while it is. They come before it in "
          "`bring_up`.",
          each_in_map([&](const Value& nodes) { read_dependencies(nodes, lifecycle); })},
         {"heartbeat", "From `10ms`. A process that has told nothing for so long is lost.",
          into_duration(lifecycle.heartbeat,
                        [&] {
                          if (lifecycle.heartbeat >= std::chrono::milliseconds(10)) return;
                          throw Error("a heartbeat is 10ms or more", "give it more time");
                        })},
         {"on_loss",
          "What follows when a node is lost. `deactivate_dependents`: those that depend on it are "
          "inactive until it is back, and active. `shutdown`: all of them are shut down. "
          "`report`: nothing else.",
          into(lifecycle.on_loss,
               {{"deactivate_dependents", LifecycleDescription::OnLoss::deactivate_dependents},
                {"shutdown", LifecycleDescription::OnLoss::shutdown},
                {"report", LifecycleDescription::OnLoss::report}})}});
    if (const Value* nodes = document::find(value, "bring_up"); is_empty_list(nodes)) {
      errors_.add(nodes->line, "the list of nodes to bring up is empty", "list at least one node");
    }
  }

  static LifecycleDescription::ManagedNode* find_managed(LifecycleDescription& lifecycle,
                                                         std::string_view name) {
    const auto found = std::find_if(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                    [&](const auto& node) { return node.name == name; });
    return found != lifecycle.bring_up.end() ? &*found : nullptr;
  }

  // The full name of the component's node; "" and an error when there is none.
  std::string find_node(const Value& value) {
    std::string name;
    into(name)(value);
    if (name.empty()) return {};
    return find_node(value.line, name);
  }
  std::string find_node(int line, const std::string& name) {
    const std::string full = name.starts_with('/') ? name : "/" + name;
    if (has_component(full)) return full;
    errors_.add(
        line, fmt::format("no component of this file is called '{}'", name),
        component_names().empty() ? "give components a 'name'" : suggest(full, component_names()));
    return {};
  }

  void read_dependencies(const Value& value, LifecycleDescription& lifecycle) {
    if (describes("list, each text")) return;
    const std::string name = find_node(value.line, value.name);
    if (name.empty()) return;
    const auto managed = [&](int line, const std::string& node) {
      auto* found = find_managed(lifecycle, node);
      if (found == nullptr) {
        errors_.add(line, fmt::format("'{}' is not brought up", node), "list it under 'bring_up'");
      }
      return found;
    };
    auto* node = managed(value.line, name);
    each_in_list([&](const Value& item) {
      const std::string needed = find_node(item);
      if (needed.empty() || node == nullptr) return;
      const auto* before = managed(item.line, needed);
      if (before == nullptr) return;
      if (before == node) {
        errors_.add(item.line, fmt::format("'{}' depends on itself", name), "leave it out");
      } else if (before > node) {
        errors_.add(item.line,
                    fmt::format("'{}' comes up before '{}', which it depends on", name, needed),
                    "turn them round in 'bring_up'");
      }
      node->depends_on.push_back(needed);
    })(value);
  }

  // ---- Components ----

  void read_component(const Value& value) {
    ComponentDescription component{.where = errors_.where(value.line)};
    read_map(
        value, "a component",
        {{"library",
          "The shared library that registers the class, as for a scheduler. Without it, the "
          "component index tells which, or `takt` itself has the class.",
          [&](const Value& library) { read_library(library, component.library); }},
         {"component", "The class, see `takt list components`.",
          into_checked(component.type, [&] { find_component(component.type, component.library); }),
          true},
         {"name",
          "The node's name. Without it, the class's own. No two components have the same full "
          "name.",
          into_node_name(component.name)},
         {"namespace", "Such as `/front`. Without it, the root.",
          into_name_space(component.name_space)},
         {"executor",
          "A name in `executors`, or `default`. Without it, that of its chain, else `default`.",
          into_executor(component.executor)},
         {"parameters",
          "Its node's parameters. Items of a list are of one type. A map in it is a prefix: `{a: "
          "{b: 1}}` is the parameter `a.b`.",
          [&](const Value& parameters) { read_parameters(parameters, "", component); }},
         {"remap", "The topic or service as the code names it → the one to use.",
          each_in_map([&](const Value& topic) { read_remap(topic, component); })},
         {"callback_groups",
          "By name. Each node has a group `default`; others are made by its code.",
          each_in_map([&](const Value& group) { read_group(group, component); })},
         {"callbacks",
          "By name. A timer is called as in the code, a subscription, service or client as its "
          "topic or service there. What a callback has of its own comes before what its group has.",
          each_in_map([&](const Value& callback) { read_callback(callback, component); })},
         {"on_exception",
          "What follows an exception of a callback. `terminate`: ends the container. "
          "`remove_node`: takes the component's node from its executors. `ignore`: it is told, "
          "and nothing else.",
          into(component.on_exception, {{"terminate", OnException::terminate},
                                        {"remove_node", OnException::remove_node},
                                        {"ignore", OnException::ignore}})},
         {"log_level", "Of its node: what is below is not logged. Without it, the process's.",
          into(component.log_level, Words<LogLevel>{{"debug", LogLevel::debug},
                                                    {"info", LogLevel::info},
                                                    {"warn", LogLevel::warn},
                                                    {"error", LogLevel::error}})}});
    add(std::move(component), value.line);
  }

  // dlopen itself would look for a path in the current directory, and for a name in the system.
  void read_library(const Value& value, std::string& library) {
    into(library)(value);
    if (library.empty()) return;
    const std::string path = beside(library);
    std::error_code too_long;  // for the name of a file
    if (library.find('/') != std::string::npos || std::filesystem::exists(path, too_long)) {
      library = path;
    }
    if (policy_ != nullptr) {
      library = policy_->permitted(library);
    } else {
      system_.libraries.push_back(real_library(library));
    }
  }

  // A path as this file means it.
  std::string beside(const std::string& path) const {
    return std::filesystem::absolute(errors_.file()).parent_path() / path;
  }

  void read_parameters(const Value& map, const std::string& prefix,
                       ComponentDescription& component) {
    each_in_map([&](const Value& value) {
      const std::string name = prefix + value.name;
      if (std::holds_alternative<document::Map>(value.content)) {
        return read_parameters(value, name + ".", component);
      }
      const std::optional<ParameterValue> parameter = parameter_value(value);
      if (!parameter) return;
      component.parameter_lines.try_emplace(name, errors_.where(value.line));
      if (!component.parameters.try_emplace(name, *parameter).second) {  // "a.b", and "b" in "a"
        errors_.add(value.line, fmt::format("the parameter '{}' has a value already", name),
                    "leave out one of the two");
      }
    })(map);
  }

  void read_remap(const Value& value, ComponentDescription& component) {
    std::string topic;
    into_topic(topic)(value);
    component.remap.try_emplace(value.name, topic);
    component.remap_lines.try_emplace(value.name, errors_.where(value.line));
  }

  void read_group(const Value& value, ComponentDescription& component) {
    CallbackGroupDescription group{.where = errors_.where(value.line)};
    std::vector<Field> fields = parameter_fields(group.parameters);
    fields.push_back({"executor",
                      "A name in `executors`, or `default`. Without it, the component's.",
                      into_executor(group.executor)});
    read_callback_map(value, "a callback group", fields, group.parameters);
    component.callback_groups.try_emplace(value.name, std::move(group));
  }

  void read_callback(const Value& value, ComponentDescription& component) {
    if (describes("as [a callback group](#a-callback-group), without `executor`")) return;
    CallbackDescription callback{.where = errors_.where(value.line)};
    read_callback_map(value, "a callback", parameter_fields(callback.parameters),
                      callback.parameters);
    component.callbacks.try_emplace(value.name, std::move(callback));
  }

  void read_callback_map(const Value& value, std::string_view whose,
                         const std::vector<Field>& fields, const CallbackParameters& parameters) {
    const std::size_t before = errors_.size();
    read_map(value, whose, fields);
    if (errors_.size() == before) errors_.passes(value.line, [&] { parameters.check(); });
  }

  std::vector<Field> parameter_fields(CallbackParameters& parameters) {
    const auto time = [this](std::optional<Nanoseconds>& target) -> Read {
      return [this, &target](const Value& value) { into_duration(target.emplace(), [] {})(value); };
    };
    return {{"priority",
             "Larger is more urgent. Without it, that of its chain, else 0. For the schedulers "
             "`fixed_priority` and `chain_priority`.",
             into(parameters.priority)},
            {"deadline",
             "Not 0. From publication or due time to the end of the callback. For the schedulers "
             "`edf` and `least_laxity`; what is missed is counted, and told.",
             time(parameters.deadline)},
            {"period", "Not 0. The least time between two messages. Without it, a timer's own.",
             time(parameters.period)},
            {"budget",
             "Not 0, and not above deadline or period. How long an execution takes at the most, "
             "by the clock. More is an overrun.",
             time(parameters.budget)},
            {"criticality",
             "Larger matters more. Without it, the priority of its chain, or 0. For "
             "`chain_priority`.",
             into(parameters.criticality)},
            {"overrun",
             "What follows when a callback misses its deadline, runs longer than its budget, or "
             "is a timer that still runs at its next release; without it, `catch_up`. `catch_up`: "
             "of the releases that came meanwhile one is served at once. `skip`: none of them is; "
             "the timer goes on in phase. `abort`: the chain instance ends, and nobody receives "
             "what it has sent. `demote`: it runs after all others until it has ended once "
             "without. It is counted whatever follows.",
             into(parameters.overrun, overrun_policies())}};
  }

  void read_changes(const Value& value, CallbackParameterChanges& changes) {
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

  // ---- Chains ----

  void read_chains(const Value& value) {
    if (describes("`auto`")) {
      return each_in_list([this](const Value& chain) { read_chain(chain); })(value);
    }
    system_.chains_where = errors_.where(value.line);
    const auto* word = std::get_if<std::string>(&value.content);
    if (word != nullptr && *word == "auto") {
      system_.finds_chains = true;
      return;
    }
    if (!std::holds_alternative<document::List>(value.content)) {
      return refuse(value, "a list of chains, or auto");
    }
    each_in_list([this](const Value& chain) { read_chain(chain); })(value);
  }

  void read_chain(const Value& value) {
    ChainDescription chain;
    std::set<std::pair<std::string, std::string>> steps;
    chain.where = errors_.where(value.line);
    read_map(
        value, "a chain",
        {{"name",
          "Also of the executor and thread that Takt assigns; entries of that name in `executors` "
          "and `threads` take their place.",
          into_node_name(chain.options.name), true},
         {"priority", "Larger is more critical.", into(chain.options.priority)},
         {"deadline", "Not 0. From end to end.",
          into_duration(chain.options.deadline,
                        [&] {
                          if (chain.options.deadline == Nanoseconds::zero()) {
                            throw Error("a deadline of 0 cannot be met",
                                        "leave it out, or give it time");
                          }
                        })},
         {"path",
          "`node/callback`. Steps may be left out where there is only one way between two that "
          "are named. A topic's first slash may be left out.",
          each_in_list([&](const Value& step) { read_step(step, chain, steps); }), true}});
    const auto is_namesake = [&](const ChainDescription& other) {
      return other.options.name == chain.options.name;
    };
    if (std::any_of(system_.chains.begin(), system_.chains.end(), is_namesake)) {
      errors_.add(value.line, fmt::format("two chains are called '{}'", chain.options.name),
                  "give each its own name");
    }
    if (const Value* path = document::find(value, "path"); is_empty_list(path)) {
      errors_.add(path->line, fmt::format("the path of chain '{}' is empty", chain.options.name),
                  "list the callbacks that it goes through");
    }
    if (!chain.path.empty()) system_.chains.push_back(std::move(chain));
  }

  // "node/callback". A callback may be called by a topic with slashes, and a node has a namespace.
  void read_step(const Value& value, ChainDescription& chain,
                 std::set<std::pair<std::string, std::string>>& steps) {
    std::string text;
    into(text)(value);
    if (text.empty()) return;
    const std::string full = text.starts_with('/') ? text : "/" + text;
    for (const std::string& name : component_names()) {
      if (full.size() <= name.size() + 1 || full[name.size()] != '/' || !full.starts_with(name)) {
        continue;
      }
      std::pair<std::string, std::string> step{name, full.substr(name.size() + 1)};
      if (!steps.insert(step).second) {
        errors_.add(value.line, fmt::format("the chain comes to '{}' twice", text),
                    "a chain ends where it would begin again");
      }
      chain.path.push_back(std::move(step));
      return;
    }
    std::vector<std::string> nodes;
    for (const std::string& name : component_names()) nodes.push_back(name.substr(1));
    errors_.add(value.line, fmt::format("'{}' is no callback of a component of this file", text),
                fmt::format("write node/callback; the nodes are {}", fmt::join(nodes, ", ")));
  }

  // A duration that the check, which throws Error, accepts.
  Read into_duration(Nanoseconds& duration, std::function<void()> check) {
    return [this, &duration, check = std::move(check)](const Value& value) {
      const bool is_set = duration != Nanoseconds::zero();
      if (describes("duration", is_set ? fmt::format("`{}`", to_string(duration)) : "")) return;
      const auto* text = std::get_if<std::string>(&value.content);
      if (text == nullptr) {
        return refuse(value, "a number and one of ns, us, ms, s, m, h, such as 20ms");
      }
      errors_.passes(value.line, [&] {
        duration = parse_duration(*text);
        check();
      });
    };
  }

  const LoadPolicy* policy_ = nullptr;  // of a request; nullptr: a file, which may load anything
  std::set<std::string> broken_schedulers_;
  std::map<std::string, ThreadAttributes> threads_;
  std::vector<ThreadAttributes> executors_threads_;  // one for each name in an executor's list
  std::set<std::string> executors_{"default"};       // always there
};

}  // namespace

std::map<std::string, CallbackParameterChanges> read_parameter_changes(const std::string& text) {
  document::Errors errors("request");
  auto changes = ConfigurationReader(errors).read_changes(document::parse_yaml(text, errors));
  errors.throw_if_any();
  return changes;
}

ComponentDescription read_component(const document::Value& component,
                                    const std::vector<std::string>& executors,
                                    const LoadPolicy& policy, document::Errors& errors) {
  return ConfigurationReader(errors).read_one(component, executors, policy);
}

std::optional<ParameterValue> read_parameter(const document::Value& value,
                                             document::Errors& errors) {
  return ConfigurationReader(errors).parameter_value(value);
}

std::vector<ReferenceSection> describe_configuration() {
  document::Errors none("");
  return ConfigurationReader(none).describe_file();
}

SystemDescription read_configuration(const document::Value& root, document::Errors& errors) {
  return ConfigurationReader(errors).read(root);
}

}  // namespace takt
