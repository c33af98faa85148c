// Whether a component is still the one that a model was measured with.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include "takt/base/regular_file.hpp"
#include "takt/containers/component.hpp"

#include "model/extraction.hpp"

namespace takt::tools {
namespace {

/// FNV-1a: it tells builds apart, and keeps nobody from forging one.
class Digest {
 public:
  void add(std::string_view text) {
    for (const char letter : text) {
      value_ = (value_ ^ static_cast<unsigned char>(letter)) * 0x100000001b3;
    }
    value_ = (value_ ^ 0x100) * 0x100000001b3;  // no text has it: where one ends
  }
  std::string text() const { return fmt::format("{:016x}", value_); }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

// Limit: bytes of a library that its digest reads. At it: the component has no digest, and a model
// of it is one from elsewhere. Seen: the assumption.
constexpr std::size_t kMostOfLibrary = std::size_t{1} << 30;

/// Whether it could be read.
bool add_content(const std::string& path, Digest& digest) {
  if (path.empty()) return true;
  try {
    digest.add(read_text(path, kMostOfLibrary));
  } catch (const Error&) {
    return false;
  }
  return true;
}

}  // namespace

std::string library_of(const ComponentDescription& component) {
  if (!component.library.empty()) return component.library;
  for (const IndexedComponent& indexed : component_index()) {
    if (indexed.name == component.type) return indexed.library;
  }
  return {};
}

std::vector<MeasuredComponent> components_of(const SystemDescription& system) {
  std::vector<MeasuredComponent> result;
  for (const ComponentDescription& component : system.components) {
    Digest digest;
    digest.add(TAKT_VERSION);
    digest.add(component.type);
    if (!add_content(library_of(component), digest)) continue;
    for (const auto& [name, value] : component.parameters) {
      digest.add(name);
      digest.add(to_string(value));
    }
    for (const auto& [from, to] : component.remap) {
      digest.add(from);
      digest.add(to);
    }
    if (component.log_level) digest.add(fmt::format("{}", static_cast<int>(*component.log_level)));
    result.push_back({.node = full_name(component), .digest = digest.text()});
  }
  return result;
}

nlohmann::json measured_with(const SystemDescription& system) {
  nlohmann::json components = nlohmann::json::object();
  for (const MeasuredComponent& component : components_of(system))
    components[component.node] = component.digest;
  return {{"components", std::move(components)}, {"settings", measured_settings(system)}};
}

}  // namespace takt::tools
