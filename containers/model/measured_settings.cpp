// Settings of a file, beside its components, that may change execution times.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/measured_model.hpp"

namespace takt {
namespace {

using Key = std::pair<std::string_view, std::string_view>;

// Execution times do not depend on these keys, or the model has them already: where and when
// callbacks run, keys for the analysis only, and keys that the digest of a component covers. All
// other keys count, also future ones. An empty key stands for all keys of its map.
constexpr std::array kFree{
    Key{"a callback", ""},
    Key{"a callback group", ""},
    Key{"a chain", ""},
    Key{"a client", ""},
    Key{"a component", ""},
    Key{"a container", ""},
    Key{"a delay", ""},
    Key{"a load policy", ""},
    Key{"a machine", ""},
    Key{"a mode", ""},
    Key{"a node", ""},
    Key{"a node of a program", ""},
    Key{"a publisher", ""},
    Key{"a publishing overhead", ""},
    Key{"a restart", ""},
    Key{"a scheduler", ""},
    Key{"a server", ""},
    Key{"a subscriber", ""},
    Key{"a thread", ""},
    Key{"a topic", "delay"},
    Key{"a topic", "must_match"},
    Key{"a trigger", ""},
    Key{"a wait back end", ""},
    Key{"an analysis", ""},
    Key{"an arrival", ""},
    Key{"an execution", ""},
    Key{"an executor", ""},
    Key{"dds", "diagnostics"},         // a thread of its own
    Key{"dds", "discovery"},           // which other processes there are: no_other_publishers
    Key{"dds", "domain"},              // the same
    Key{"dds", "parameter_services"},  // a thread of its own
    Key{"dds", "ros_graph"},
    Key{"dds", "synchronized_clocks"},
    Key{"dds", "threads"},
    Key{"memory", "lock"},  // no_page_faults
    Key{"overheads", ""},
    Key{"the file", "accept"},
    Key{"the file", "analysis"},
    Key{"the file", "chains"},
    Key{"the file", "container"},
    Key{"the file", "containers"},
    Key{"the file", "executors"},
    Key{"the file", "lifecycle"},
    Key{"the file", "machine"},
    Key{"the file", "memory"},
    Key{"the file", "model"},
    Key{"the file", "modes"},
    Key{"the file", "nodes"},
    Key{"the file", "priorities"},
    Key{"the file", "realtime"},
    Key{"the file", "schedulers"},
    Key{"the file", "threads"},
    Key{"the file", "topics"},
    Key{"the file", "wait_backends"},
    Key{"the lifecycle", ""},
    Key{"what leads to a mode", ""},
};

bool is_free(const WrittenKey& written) {
  return std::any_of(kFree.begin(), kFree.end(), [&](const Key& free) {
    return free.first == written.map && (free.second.empty() || free.second == written.key);
  });
}

}  // namespace

std::map<std::string, std::string> measured_settings(const SystemDescription& system) {
  std::map<std::string, std::string> result;
  for (const WrittenKey& written : system.keys) {
    if (is_free(written)) continue;
    result[written.entry.empty() ? written.key : written.entry + "." + written.key] = written.value;
  }
  return result;
}

}  // namespace takt
