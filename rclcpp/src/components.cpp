// The classes of nodes that libraries have registered.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

#include <dlfcn.h>
#include <link.h>

#include "takt/base/error.hpp"
#include "takt/base/never_destroyed.hpp"

#include "rclcpp_components/register_node_macro.hpp"

namespace rclcpp_components::detail {
namespace {

struct Factories {
  std::mutex mutex;
  std::vector<RegisteredFactory> all;
};
// Never destroyed: libraries that register factories are initialised and unloaded in any order.
Factories& factories() {
  static takt::detail::NeverDestroyed<Factories> known;
  return *known;
}

}  // namespace

bool register_factory(const char* name, std::shared_ptr<NodeFactory> factory, const void* code) {
  Dl_info library{};
  dladdr(code, &library);
  std::error_code none;
  const std::string file =
      std::filesystem::weakly_canonical(library.dli_fname != nullptr ? library.dli_fname : "", none)
          .string();
  const std::lock_guard lock(factories().mutex);
  factories().all.push_back({name, file, std::move(factory)});
  return true;
}

std::vector<RegisteredFactory> registered_factories() {
  const std::lock_guard lock(factories().mutex);
  return factories().all;
}

NodeInstanceWrapper make_node(const std::string& name, const rclcpp::NodeOptions& options) {
  for (const RegisteredFactory& one : registered_factories()) {
    if (one.name == name) return one.factory->create_node_instance(options);
  }
  throw takt::Error("no library that is loaded has registered the component " + name,
                    "write RCLCPP_COMPONENTS_REGISTER_NODE(" + name +
                        ") into its code, with the name as CMake has it");
}

std::unique_ptr<takt::Component> component_of(NodeFactory& factory,
                                              const takt::NodeOptions& options) {
  struct Inside {
    rclcpp::node_interfaces::NodeBaseInterface::SharedPtr base;  // destroyed last
    NodeInstanceWrapper node;
  };
  const auto context = rclcpp::contexts::get_global_default_context();
  context->enter_container(options);
  const auto inside = std::make_shared<Inside>();
  inside->node = factory.create_node_instance(rclcpp::NodeOptions(options));
  inside->base = inside->node.get_node_base_interface();
  return std::make_unique<takt::Component>(
      takt::Component{std::shared_ptr<takt::Node>(inside, inside->base->takt_node().get()),
                      [context] { context->shutdown("the container ends"); }});
}

bool open_library(const std::string& path, std::string& file, std::string& error) {
  void* const library = dlopen(path.empty() ? nullptr : path.c_str(), RTLD_NOW);
  if (library == nullptr) {
    error = dlerror();
    return false;
  }
  link_map* map = nullptr;
  if (!path.empty() && dlinfo(library, RTLD_DI_LINKMAP, &map) == 0) {
    std::error_code none;
    file = std::filesystem::weakly_canonical(map->l_name, none).string();
  }
  return true;
}

}  // namespace rclcpp_components::detail
