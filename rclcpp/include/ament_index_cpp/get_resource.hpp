// What packages have entered into the index.
// SPDX-License-Identifier: Apache-2.0
#ifndef AMENT_INDEX_CPP__GET_RESOURCE_HPP_
#define AMENT_INDEX_CPP__GET_RESOURCE_HPP_

#include <map>
#include <string>

namespace ament_index_cpp {

/// Whether there is such an entry; if so, its text and its prefix.
bool get_resource(const std::string& type, const std::string& name, std::string& content,
                  std::string* prefix_path = nullptr);
bool has_resource(const std::string& type, const std::string& name,
                  std::string* prefix_path = nullptr);
/// Of a type: names and their prefixes.
std::map<std::string, std::string> get_resources(const std::string& type);

}  // namespace ament_index_cpp

#endif  // AMENT_INDEX_CPP__GET_RESOURCE_HPP_
