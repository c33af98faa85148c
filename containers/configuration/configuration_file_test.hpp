// For tests: temporary configuration files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_FILE_TEST_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_FILE_TEST_HPP_

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace takt {

/// A configuration file in a temporary directory, which the destructor removes.
/// Thread safety: none.
/// Real-time: no.
class ConfigurationFile {
 public:
  ConfigurationFile(const std::string& name, std::string_view text) {
    std::string directory = testing::TempDir() + "takt_XXXXXX";
    if (mkdtemp(directory.data()) == nullptr) ADD_FAILURE() << "no directory " << directory;
    directory_ = directory;
    std::ofstream(path(name), std::ios::binary) << text;
    name_ = name;
  }
  ~ConfigurationFile() { std::filesystem::remove_all(directory_); }
  ConfigurationFile(const ConfigurationFile&) = delete;
  ConfigurationFile& operator=(const ConfigurationFile&) = delete;

  std::string path() const { return path(name_); }

  SystemDescription read() const { return read_system(path()); }
  /// All errors, one per line, without the file's directory.
  std::string errors() const {
    try {
      read();
      return "no error\n";
    } catch (const ConfigurationError& error) {
      std::string result;
      for (const std::string& message : error.errors()) {
        EXPECT_TRUE(message.starts_with(directory_.string() + "/")) << message;
        result += message.substr(directory_.string().size() + 1) + "\n";
      }
      return result;
    }
  }

 private:
  std::string path(const std::string& name) const { return (directory_ / name).string(); }

  std::filesystem::path directory_;
  std::string name_;
};

/// Registers a stand-in for takt::Workload: the reader only checks that the class exists, and its
/// library may not be linked to this test.
inline void provide_workload() {
  try {
    components().check("takt::Workload");
  } catch (const Error&) {
    components().add("takt::Workload", {"stands for the real one", [](const NodeOptions& options) {
                                          return std::make_unique<Component>(Component{
                                              std::make_shared<Node>("workload", options)});
                                        }});
  }
}

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_FILE_TEST_HPP_
