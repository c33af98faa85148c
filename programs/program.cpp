// SPDX-License-Identifier: Apache-2.0
#include "takt/programs/program.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

#include <unistd.h>

#include "takt/base/printable.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/containers/lttng.hpp"
#include "takt/programs/description.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt::programs {
namespace {

void print(const char* kind, const std::string& text, Lines lines = Lines::escape) {
  std::fprintf(stderr, "%s: %s\n", kind, printable(text, lines).c_str());
}

/// For what destructors call.
template <class F>
void note_failure(F&& function) noexcept {
  try {
    function();
  } catch (const std::exception& error) {
    print("note", error.what());
  }
}

constexpr int kBadUsage = 2;  // as of `takt` with a wrong file

std::terminate_handler other_handler = nullptr;  // the program's, or the language's

/// Few programs catch what is wrong with the environment, and nobody needs their core.
[[noreturn]] void end_with_error() {
  try {
    if (std::current_exception() != nullptr) throw;
  } catch (const Error& error) {
    print("error", error.what(), Lines::keep);
    std::_Exit(kBadUsage);
  } catch (...) {
  }
  other_handler();
  std::abort();
}

void catch_errors() {
  constexpr const char* kVariables[] = {"TAKT_EXECUTOR",        "TAKT_PLACEMENT", "TAKT_SCHEDULER",
                                        "TAKT_CONFIG",          "TAKT_RESULTS",   "TAKT_NODES",
                                        "TAKT_CONFIG_TEMPLATE", "TAKT_LTTNG",     "TAKT_SIMULATE"};
  const auto is_set = [](const char* name) { return std::getenv(name) != nullptr; };
  if (std::any_of(std::begin(kVariables), std::end(kVariables), is_set)) {
    other_handler = std::set_terminate(end_with_error);
  }
}

/// Empty: it is not set.
std::string quiet_variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}
/// What somebody exported long ago would surprise.
std::string variable(const char* name) {
  std::string value = quiet_variable(name);
  if (!value.empty()) print("note", std::string(name) + "=" + value + " is in force");
  return value;
}

/// How many executions the results keep of each thread.
std::size_t trace_events() {
  const std::string text = quiet_variable("TAKT_TRACE");
  if (text.empty()) return 0;
  // Limit: executions that a program records of each thread. At it: the program ends. Seen: the
  // error.
  constexpr std::size_t kMostEvents = 10'000'000;
  std::size_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error == std::errc() && rest == end && number <= kMostEvents) return number;
  throw Error("no number of executions from 0 to 10000000", "", "TAKT_TRACE=" + printable(text));
}

template <class Registry>
void check(const Registry& registry, const std::string& name, const char* variable) {
  if (name.empty()) return;
  try {
    registry.check(name);
  } catch (const Error& error) {
    throw Error(printable(error.what()), "", variable);
  }
}

}  // namespace

Program& Program::instance() {
  static auto* const program = new Program;  // never destroyed: nodes with static storage use it
  return *program;
}

Program::Program() {
  catch_errors();
  const std::string how_to_simulate = quiet_variable("TAKT_SIMULATE");
  const auto read = how_to_simulate.empty() ? variable : quiet_variable;
  variables_.executor = read("TAKT_EXECUTOR");
  variables_.placement = read("TAKT_PLACEMENT");
  variables_.scheduler = read("TAKT_SCHEDULER");
  variables_.results = quiet_variable("TAKT_RESULTS");
  if (!variables_.results.empty()) variables_.trace_events = trace_events();
  read_file(how_to_simulate);
  const std::string refused = load_tracepoints_if_asked(file_ ? &*file_ : nullptr);
  if (!refused.empty()) print("note", refused);
  if (const std::string path = variable("TAKT_CONFIG_TEMPLATE"); !path.empty()) {
    if (file_) {
      throw Error("a file is in force already", "leave out TAKT_CONFIG",
                  "TAKT_CONFIG_TEMPLATE=" + path);
    }
    template_.emplace(path);
  }
  variables_.nodes = quiet_variable("TAKT_NODES");
  if (!variables_.nodes.empty() && !file_) {
    throw Error("there is no file whose nodes could be described", "set TAKT_CONFIG",
                "TAKT_NODES=" + variables_.nodes);
  }
  if (!variables_.results.empty() && !simulated_)
    results_.emplace(variables_.results, variables_.trace_events);
  // The file may have loaded them.
  check(executors(), variables_.executor, "TAKT_EXECUTOR");
  check(schedulers(), variables_.scheduler, "TAKT_SCHEDULER");
  if (!variables_.placement.empty()) parse_placement(variables_.placement, "TAKT_PLACEMENT");
  if (!file_ && !template_ && !results_) return;
  on_exit(  // nothing throws any more
      [](int status, void* /*unused*/) {
        const int failure = instance().at_exit();
        // glibc goes on with the other functions then, and ends with this status.
        if (status == 0 && failure != 0) std::exit(failure);
      },
      nullptr);
}

void Program::read_file(const std::string& how_to_simulate) {
  const bool simulates = !how_to_simulate.empty();
  const std::string path = simulates ? quiet_variable("TAKT_CONFIG") : variable("TAKT_CONFIG");
  if (simulates) {
    simulated_ = std::make_unique<SimulatedProgram>(how_to_simulate, path, overrides());
    file_ = simulated_->file();
  } else if (!path.empty()) {
    file_ = read_system(path);
  }
  if (!file_ || file_->components.empty() || file_->components.front().type.empty()) return;
  throw Error("the file describes containers",
              "run it with `takt run`, or describe the "
              "nodes of this program under 'nodes'",
              path);
}

std::unique_ptr<Executor> Program::make_executor(const std::string& type, ExecutorOptions options) {
  const std::string& chosen = variables_.executor.empty() ? type : variables_.executor;
  if (!variables_.scheduler.empty()) options.scheduler = variables_.scheduler;
  const ExecutorTraits traits = executors().traits(chosen);
  if (options.threads.size() > traits.max_threads) options.threads.resize(traits.max_threads);
  // A band has ascending priorities on one CPU: the threads of another type are none.
  if (traits.takes_band && chosen != type) options.threads.clear();
  options.trace_events = variables_.trace_events;
  auto executor = executors().make(chosen, options);
  const std::lock_guard lock(mutex_);
  if (template_) {
    const bool has_one = options.threads.empty() && traits.max_threads == 1 && !traits.isolates;
    template_->made(*executor, chosen, has_one ? 1 : options.threads.size());
  }
  if (results_) results_->made(*executor, chosen, options.scheduler);
  return executor;
}
void Program::ends(const Executor& executor) noexcept {
  note_failure([&] {
    const std::lock_guard lock(mutex_);
    if (template_) template_->ends(executor);
    if (results_) results_->ends(executor);
  });
}

// ---- Nodes ----

const ComponentDescription* Program::find(const std::string& name) const {
  if (!file_) return nullptr;
  const auto found =
      std::find_if(file_->components.begin(), file_->components.end(),
                   [&](const auto& component) { return full_name(component) == name; });
  return found != file_->components.end() ? &*found : nullptr;
}

bool Program::serves(const Node& node, const CallbackGroup* group) const {
  const ComponentDescription* const described = find(node.fully_qualified_name());
  if (described == nullptr) return false;
  if (group == nullptr || group->automatically_add_to_executor()) return true;
  const auto found = described->callback_groups.find(group->name());
  return found != described->callback_groups.end() && !found->second.executor.empty();
}

bool Program::removes(const Node& node, const CallbackGroup* group) const {
  const bool is_static =
      !variables_.executor.empty() && executors().traits(variables_.executor).frozen;
  return !is_static && !serves(node, group);
}

void Program::made(const std::shared_ptr<const Node>& node) {
  if (!file_) return;
  const std::lock_guard lock(mutex_);
  const std::string& name = node->fully_qualified_name();
  // One of a name will do, but where all that live are described.
  if (!variables_.nodes.empty() || !made_.contains(name)) made_.emplace(name, node);
}

namespace {
/// Of the component with this name; 0: there is none.
std::uint64_t id_of(const Container& container, const std::string& name) {
  for (const LoadedComponent& component : container.components()) {
    if (component.name == name) return component.id;
  }
  return 0;
}
}  // namespace

void Program::gone(const Node& node) noexcept {
  if (!serves(node)) return;
  std::shared_ptr<Container> container;
  {
    const std::lock_guard lock(mutex_);
    container = container_;
  }
  if (container == nullptr) return;
  note_failure([&] {
    const std::uint64_t id = id_of(*container, node.fully_qualified_name());
    if (id != 0) container->unload_here(id);
  });
}

bool Program::add(const std::shared_ptr<Node>& node, const Executor& executor,
                  const CallbackGroup* group) {
  const std::lock_guard lock(mutex_);
  if (template_) template_->added(node, group, executor);
  if (results_) results_->added(node);
  if (simulated_ && !serves(*node, group))
    refuse("spins '" + node->fully_qualified_name() + "', which its file does not name");
  if (!serves(*node)) return true;
  std::erase_if(added_,
                [&](const auto& known) { return known.expired() || is_same_owner(known, node); });
  added_.push_back(node);
  const std::string& name = node->fully_qualified_name();
  if (container_ != nullptr && !is_over_ && id_of(*container_, name) == 0) {
    container_->load(*find(name));
  }
  return !serves(*node, group);
}

void Program::check_nodes() const {
  std::vector<std::string> errors;
  std::vector<std::string> names;
  for (const auto& [name, node] : made_) names.push_back(name);
  for (const ComponentDescription& component : file_->components) {
    const std::string name = full_name(component);
    if (made_.contains(name)) continue;
    errors.push_back(
        Error("this program has no node '" + name + "'", suggest(name, names), component.where)
            .what());
  }
  if (!errors.empty()) throw ConfigurationError(errors);
}

bool Program::has_all_nodes() const {
  return std::all_of(file_->components.begin(), file_->components.end(), [&](const auto& wanted) {
    return std::any_of(added_.begin(), added_.end(), [&](const auto& weak) {
      const auto node = weak.lock();
      return node != nullptr && node->fully_qualified_name() == full_name(wanted);
    });
  });
}

// Does not return: nobody waits for what its callbacks would do.
void Program::describe_nodes() const {
  check_nodes();
  std::vector<std::shared_ptr<const Node>> nodes, others;
  for (const auto& weak : added_) {
    if (auto node = weak.lock()) nodes.push_back(std::move(node));
  }
  for (const auto& [name, weak] : made_) {
    auto node = weak.lock();
    if (node != nullptr && std::find(nodes.begin(), nodes.end(), node) == nodes.end())
      others.push_back(std::move(node));
  }
  write_description(nodes, others, variables_.nodes);
  std::_Exit(0);
}

// ---- Spinning ----

ContainerOverrides Program::overrides() const {
  ContainerOverrides overrides;
  overrides.executor = variables_.executor;
  if (!variables_.placement.empty()) {
    overrides.placement = parse_placement(variables_.placement);
  }
  overrides.scheduler = variables_.scheduler;
  overrides.trace_events = variables_.trace_events;
  overrides.find_node = [this](const ComponentDescription& wanted) {
    for (const auto& weak : added_) {
      const auto node = weak.lock();
      if (node != nullptr && node->fully_qualified_name() == full_name(wanted)) return node;
    }
    return std::shared_ptr<Node>();
  };
  return overrides;
}

// With the mutex held; not if there is nothing to serve, or while another one ends.
void Program::start() {
  const bool has_any =
      std::any_of(added_.begin(), added_.end(), [](const auto& node) { return !node.expired(); });
  if (container_ != nullptr || is_ending_ || !has_any) return;
  ContainerOverrides overrides = this->overrides();
  for (const auto& weak : added_) {
    const auto node = weak.lock();
    if (node != nullptr && overrides.participant == nullptr)
      overrides.participant = node->participant();
  }
  SystemDescription description = *file_;
  // What has started the program has chosen it, and its beginning is enough for `takt top`.
  description.name = printable(std::string_view(program_invocation_short_name).substr(0, 40));
  const auto made = std::make_shared<Container>(description, overrides);
  is_over_ = false;
  made->start([this] { on_failure(); });  // which waits for the mutex
  made->release();
  container_ = made;
  is_serving_.store(true);
}

// Without the mutex, as callbacks may wait for it. If another thread does it, waits for that one.
void Program::stop() {
  std::shared_ptr<Container> ended;
  {
    std::unique_lock lock(mutex_);
    // Waits for a thread that spins for long, which is in no callback of the container.
    ended_.wait(lock, [this] { return !is_ending_; });
    if (container_ == nullptr) return;
    ended.swap(container_);
    is_ending_ = true;
    is_serving_.store(false);
  }
  ended->cancel();
  std::exception_ptr failure;
  try {
    ended->join();
  } catch (...) {
    failure = std::current_exception();
  }
  const ProcessResult result = ended->result();
  ended.reset();
  const std::lock_guard lock(mutex_);
  for (const std::string& text : result.notes) {
    if (notes_.insert(text).second) print("note", text);
  }
  if (results_) results_->add(result);
  is_ending_ = false;
  ended_.notify_all();
  if (failure != nullptr) std::rethrow_exception(failure);
  const bool is_needed = std::any_of(spinning_.begin(), spinning_.end(),
                                     [](const LongSpin* spin) { return spin->is_valid(); });
  if (is_needed) start();  // by a spin of another context, or that began meanwhile
}

// Without the mutex, as callbacks may wait for it.
void Program::simulate(LongSpin* spin) {
  if (simulated_->has_run()) throw Error("a simulation has one spin()", "end the program after it");
  if (spin == nullptr) refuse("spins without spin(), as by spin_some()");
  try {
    simulated_->run(variables_.results);
  } catch (...) {
    spin->shut_down();
    throw;
  }
  spin->shut_down();
}

void Program::on_failure() {
  const std::lock_guard lock(mutex_);
  is_over_ = true;
  for (LongSpin* const spin : spinning_) spin->cancel();
}

void Program::cancel() noexcept {
  refuse("shuts down before the end");
  if (!is_serving()) return;
  const std::lock_guard lock(mutex_);
  is_over_ = true;
  if (container_ != nullptr) container_->cancel();
}

void Program::begin_spin(LongSpin* spin) {
  std::unique_lock lock(mutex_);
  if (template_) template_->spins();
  if (results_) results_->spins();
  if (!file_) return;
  const bool is_main = getpid() == gettid(), is_long = spin != nullptr;
  if (simulated_) {
    check_nodes();
    lock.unlock();
    return simulate(spin);
  }
  if (!variables_.nodes.empty() && ((is_main && is_long) || has_all_nodes())) describe_nodes();
  if (is_main && is_long) check_nodes();
  if (is_over_ && (is_long || is_main)) {  // not a callback of the container
    lock.unlock();
    stop();
    lock.lock();
  }
  start();
  if (is_long) spinning_.push_back(spin);
}

void Program::has_spun() noexcept {
  if (!results_) return;
  note_failure([this] {
    const std::lock_guard lock(mutex_);
    results_->has_spun(false);
  });
}

// One of others that goes on is enough for the container, but not after a shutdown.
void Program::end_spin(const LongSpin& spin) {
  {
    const std::lock_guard lock(mutex_);
    if (results_) results_->has_spun(true);
    if (!file_) return;
    std::erase(spinning_, &spin);
    if (!spinning_.empty() && !is_over_ && spin.is_valid()) return;
  }
  stop();
}

// The container stays: a callback on one of its threads may have called exit, for which all others
// wait, or which waits for them.
void Program::join() {
  std::unique_lock lock(mutex_);
  const auto container = container_;
  lock.unlock();
  if (container != nullptr && getpid() == gettid()) container->join();
}

int Program::at_exit() noexcept {
  int status = 0;
  const auto report = [&](const auto& function) {
    try {
      function();
    } catch (const ConfigurationError& error) {
      print("error", error.what(), Lines::keep);
      status = kBadUsage;
    } catch (const std::exception& error) {
      print("error", error.what());
      status = std::max(status, 1);
    }
  };
  if (simulated_ && !simulated_->has_run()) refuse("never calls spin()");
  cancel();
  report([this] { join(); });
  const std::lock_guard lock(mutex_);
  if (file_) report([this] { check_nodes(); });
  if (template_) report([this] { template_->write(); });
  if (!results_) return status;
  try {
    if (container_ != nullptr) results_->add(container_->result());
  } catch (const Error&) {  // it spins: a callback has called exit
    results_->note_spinning("of the file");
  }
  report(
      [this] { results_->write(variables_.executor, variables_.placement, variables_.scheduler); });
  return status;
}

}  // namespace takt::programs
