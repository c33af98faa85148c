// Loads the components of a library, as programs for rclcpp do it by themselves.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <stdexcept>
#include <string>

#include "class_loader/class_loader.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_components/node_factory.hpp"
#include "rcpputils/shared_library.hpp"
#include "sky_components/msg/report.hpp"
#include "sky_library/sky_library.hpp"  // of a package on which sky_nodes depends

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  if (sky_library::lowest({}) < 1) return 1;
  std::string found;
  {  // by its name alone, in the place where packages are installed; it stays loaded
    rcpputils::SharedLibrary library(rcpputils::get_platform_library_name("watcher"));
    found = library.get_library_path();
  }
  rclcpp::executors::SingleThreadedExecutor executor;
  class_loader::ClassLoader loader(argv[1]);
  for (const auto& name : loader.getAvailableClasses<rclcpp_components::NodeFactory>()) {
    std::printf("%s\n", name.c_str());
    auto node = loader.createInstance<rclcpp_components::NodeFactory>(name)->create_node_instance(
        rclcpp::NodeOptions());
    executor.add_node(node.get_node_base_interface());
    executor.spin();
    executor.remove_node(node.get_node_base_interface());
  }
  std::printf("it is %s\n", found.substr(found.rfind('/') + 1).c_str());
  try {
    class_loader::ClassLoader("nowhere.so");
  } catch (const class_loader::LibraryLoadException& error) {
    sky_components::msg::Report report;
    report.skies.resize(2);
    std::printf("refused, %zu\n", report.skies.size());
  }
}
