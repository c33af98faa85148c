// Resources that packages have registered in the ament index.
// SPDX-License-Identifier: Apache-2.0
#ifndef AMENT_INDEX_CPP__GET_RESOURCE_HPP_
#define AMENT_INDEX_CPP__GET_RESOURCE_HPP_

#include <map>
#include <string>

namespace ament_index_cpp {

/// Whether the resource exists; if so, sets its content and the prefix in which it is installed.
bool get_resource(const std::string& type, const std::string& name, std::string& content,
                  std::string* prefix_path = nullptr);
bool has_resource(const std::string& type, const std::string& name,
                  std::string* prefix_path = nullptr);
/// All resources of this type: their names and prefixes.
std::map<std::string, std::string> get_resources(const std::string& type);

}  // namespace ament_index_cpp

#endif  // AMENT_INDEX_CPP__GET_RESOURCE_HPP_
