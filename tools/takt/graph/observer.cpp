// SPDX-License-Identifier: Apache-2.0
#include "graph/observer.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/messages/message_types.hpp"

#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/end_signals.hpp"
#include "run/live_line.hpp"

namespace takt::tools {
namespace {

std::shared_ptr<Participant> join(const ObserverOptions& observer) {
  for (const std::string& library : observer.libraries) load_message_types(library);
  DdsOptions options{.domain = observer.domain.number()};
  options.ros_graph = observer.form;
  options.shared_memory = SharedMemory::off;  // an observer must not use up the system's chunks
  auto participant = Participant::create(options);
  begin_work();
  return participant;
}

}  // namespace

void add_observer_options(CLI::App& command, ObserverOptions& options, bool has_json) {
  options.domain.add_to(command);
  one_of(command.add_option_function<std::string>(
             "--ros",
             [&options](const std::string& name) {
               options.form = name == "humble" ? RosGraph::humble : RosGraph::jazzy;
             },
             "Format of node announcements: jazzy (Iron and later) or humble (and earlier) "
             "(default: jazzy)"),
         {"jazzy", "humble"});
  if (has_json) {
    add_output(command, "--json", options.json_path, "Also write the table as JSON; - for stdout");
  }
}

void add_library_option(CLI::App& command, std::vector<std::string>& libraries) {
  command
      .add_option("--library", libraries,
                  "A shared library that registers message types; may be repeated")
      ->allow_extra_args(false);
}

bool is_hidden(const std::string& name) {
  return name.find("/_") != std::string::npos;
}

std::vector<GraphEndpoint> ends_of(const std::vector<GraphEndpoint>& all, const std::string& name) {
  std::vector<GraphEndpoint> ends;
  std::copy_if(all.begin(), all.end(), std::back_inserter(ends),
               [&](const GraphEndpoint& end) { return end.name == name; });
  return ends;
}

std::string process_of(const GraphEndpoint& end) {
  return end.gid.substr(0, 12 * 3 - 1);
}

std::string absolute(const std::string& name) {
  return name.starts_with('/') ? name : "/" + name;
}

Observer::Observer(const ObserverOptions& options)
    : participant_(join(options)),
      node_(std::make_shared<Node>(fmt::format("_takt_{}", getpid()),
                                   NodeOptions{.participant = participant_})) {
}

Graph Observer::graph(const std::function<bool(const Graph&)>& is_there) const {
  const LiveLine line(kDiscovering);
  Graph graph = participant_->graph();
  for (int i = 0; i < 60 && !is_there(graph); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    graph = participant_->graph();
  }
  return graph;
}

Graph Observer::whole_graph(const std::function<bool(const Graph&)>& is_there) const {
  participant_->graph();  // starts to listen to node announcements
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  return graph(is_there);
}

void Observer::run(Nanoseconds duration, bool ends_by_itself, Nanoseconds pause) {
  const EndSignals signals(EndSignals::Command::looks);
  int came = 0;
  const auto signal = node_->create_file_descriptor(
      "signal", signals.fd(), FileDescriptorEvents::readable, [&](FileDescriptorEvents) {
        if ((came = signals.take()) != 0) stop();
      });
  add(signal);
  std::shared_ptr<Timer> end;
  if (duration != Nanoseconds::zero()) {
    add(end = node_->create_timer("end", duration, [this] { stop(); }));
  }
  std::optional<LiveLine> line(std::in_place, "waiting for messages");
  while (!is_stopped_) {
    bool has_messages = false;
    for (const auto& entity : wait_set_.wait()) {
      has_messages = has_messages || entity->kind() == EntityKind::subscription;
      line.reset();  // the callbacks write
      for (Slot slot; !is_stopped_ && entity->take(slot); slot = {}) entity->execute(slot);
    }
    if (has_messages && !is_stopped_) std::this_thread::sleep_for(pause);
  }
  check_complete(came, ends_by_itself || duration != Nanoseconds::zero());
}

std::string type_of(const std::vector<GraphEndpoint>& some,
                    const std::vector<GraphEndpoint>& others, const std::string& name,
                    const char* what) {
  std::set<std::string> types, names;
  for (const auto* list : {&some, &others}) {
    for (const GraphEndpoint& endpoint : *list) {
      names.insert(endpoint.name);
      if (endpoint.name == name) types.insert(endpoint.type);
    }
  }
  if (types.size() == 1) return *types.begin();
  if (!types.empty()) {
    throw Error(fmt::format("{} '{}' has several types: {}", what, name, fmt::join(types, ", ")),
                "choose one with --type");
  }
  const std::vector<std::string> known(names.begin(), names.end());
  throw Error(fmt::format("there is no {} '{}'", what, name),
              known.empty() ? "nothing was discovered on this DDS domain (--domain, ROS_DOMAIN_ID)"
                            : suggest(name, known));
}

}  // namespace takt::tools
