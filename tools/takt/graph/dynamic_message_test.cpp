// Messages of types that are known by a definition only, against those of ROS 2 Jazzy.
// SPDX-License-Identifier: Apache-2.0
#include "graph/dynamic_message.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/messages/described_types.hpp"
#include "takt/messages/message_types.hpp"

#include "graph/definitions.hpp"

namespace takt::tools {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

std::vector<std::byte> bytes_of(const std::string& hex) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

std::string hash_of(const std::string& name, const DescribedTypes& types) {
  if (name.find("/srv/") != std::string::npos) {
    return type_hash(
        *describe_service(*types.find(name + "_Request"), *types.find(name + "_Response")));
  }
  if (name.find("/action/") != std::string::npos) {
    return type_hash(*describe_action(*types.find(name + "_Goal"), *types.find(name + "_Result"),
                                      *types.find(name + "_Feedback")));
  }
  return type_hash(*types.find(name));
}

TEST(DynamicMessage, EveryTypeOfRos2HasItsHashValuesAndBytes) {
  const auto theirs = nlohmann::json::parse(std::ifstream(TAKT_ROS_TYPES_FILE));
  ASSERT_EQ(theirs.size(), 194u);
  for (const auto& [name, known] : theirs.items()) {
    SCOPED_TRACE(name);
    const auto description = defined(name);
    ASSERT_TRUE(description);
    const DescribedTypes types(*description);
    EXPECT_EQ(hash_of(name, types), known.at("hash"));
    for (const auto& [part, sample] : known.at("samples").items()) {
      SCOPED_TRACE(part);
      const bool is_message = name.find("/msg/") != std::string::npos;
      const MessageType* type = types.find(is_message ? name : name + "_" + part);
      ASSERT_NE(type, nullptr);
      const std::vector<std::byte> bytes = bytes_of(sample.at("cdr_hex"));
      EXPECT_EQ(nlohmann::json(read_message(*type, bytes)), sample.at("values"));
      const ByteBuffer ours = write_message(*type, sample.at("values").dump());
      EXPECT_TRUE(std::ranges::equal(ours.bytes(), bytes));
    }
  }
}

class Installed : public testing::Test {
 protected:
  Installed() {
    std::filesystem::create_directories(folder_ / "share/my_msgs/msg");
    std::filesystem::create_directories(folder_ / "share/my_msgs/srv");
    setenv("AMENT_PREFIX_PATH", ("/nowhere:" + folder_.string()).c_str(), 1);
  }
  ~Installed() {
    unsetenv("AMENT_PREFIX_PATH");
    std::filesystem::remove_all(folder_);
  }
  void write(const std::string& file, const std::string& text) {
    std::ofstream(folder_ / "share/my_msgs" / file) << text;
  }

 private:
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("takt_definitions_" + std::to_string(getpid()));
};

TEST_F(Installed, ATypeIsKnownByItsFile) {
  write("msg/Leg.msg",
        "# A leg.\nstd_msgs/Header header\nuint8 LEFT = 1  # a constant\nuint8 side 1\n"
        "string<=5 name \"a # b\" # the default\nfloat64[3] joints\nWheel[<=2] wheels\n"
        "wstring[] notes\n");
  write("msg/Wheel.msg", "int16 turns\n\n");
  const DescribedTypes types(defined("my_msgs/msg/Leg").value());
  const MessageType* leg = types.find("my_msgs/msg/Leg");
  ASSERT_NE(leg, nullptr);
  EXPECT_THAT(message_definition(*leg),
              StartsWith("std_msgs/Header header\nuint8 side\nstring<=5 name\nfloat64[3] joints\n"
                         "my_msgs/Wheel[<=2] wheels\nwstring[] notes\n==="));
  const std::string text =
      R"({"header":{"stamp":{"sec":0,"nanosec":0},"frame_id":""},"side":2,"name":"abc",)"
      R"("joints":[1.0,2.0,3.0],"wheels":[{"turns":-7}],"notes":["ü","€"]})";
  EXPECT_EQ(read_message(*leg, write_message(*leg, text).bytes()).dump(), text);
}

// `ros2 topic echo` prints a `byte` as the character with that code, numbers of other types as
// such.
TEST_F(Installed, AByteIsACharacterWhereItIsPrinted) {
  write("msg/Bits.msg", "byte one\nbyte[] more\nuint8 number\nchar letter\n");
  const DescribedTypes types(defined("my_msgs/msg/Bits").value());
  const MessageType* bits = types.find("my_msgs/msg/Bits");
  const auto message = write_message(*bits, "{one: 65, more: [0, 200], number: 65, letter: 65}");
  EXPECT_EQ(to_yaml(read_message(*bits, message.bytes(), {.bytes_as_text = true})),
            "one: \"A\"\nmore: [\"\\u0000\", \"È\"]\nnumber: 65\nletter: 65\n");
  EXPECT_EQ(read_message(*bits, message.bytes()).dump(),
            R"({"one":65,"more":[0,200],"number":65,"letter":65})");
}

TEST_F(Installed, WhatIsNotGivenHasItsDefault) {
  write("msg/Leg.msg",
        "uint8 side 1\nbool up true\nstring name \"a # b\"\nstring word on\nfloat64[3] joints [1, "
        "2.5, 3]\n"
        "string<=3[] tags [\"x\", 'y']\nint64 low -9223372036854775808\nWheel[2] wheels\nint8 "
        "none\n");
  write("msg/Wheel.msg", "int16 turns 7\n");
  const DescribedTypes types(defined("my_msgs/msg/Leg").value());
  const MessageType& leg = *types.find("my_msgs/msg/Leg");
  const auto sent = [&](const std::string& text) {
    return read_message(leg, write_message(leg, text).bytes()).dump();
  };
  EXPECT_EQ(
      sent(""),
      R"({"side":1,"up":true,"name":"a # b","word":"on","joints":[1.0,2.5,3.0],"tags":["x","y"],)"
      R"("low":-9223372036854775808,"wheels":[{"turns":7},{"turns":7}],"none":0})");
  EXPECT_EQ(sent("{side: 0, up: off, name: '', joints: [4], tags: [], wheels: [{}, {turns: 010}]}"),
            R"({"side":0,"up":false,"name":"","word":"on","joints":[4.0,0.0,0.0],"tags":[],)"
            R"("low":-9223372036854775808,"wheels":[{"turns":7},{"turns":8}],"none":0})");
}

TEST(DynamicMessage, OfATypeOfThisProgramHasItsDefaults) {
  const auto sent = [](const char* name, const std::string& text) {
    const MessageType& type = *message_types().find(name);
    return nlohmann::json(read_message(type, write_message(type, text).bytes())).dump();
  };
  EXPECT_EQ(sent("geometry_msgs/msg/Quaternion", "{x: 0}"), R"({"w":1.0,"x":0.0,"y":0.0,"z":0.0})");
  EXPECT_EQ(sent("geometry_msgs/msg/Quaternion", "{w: 0}"), R"({"w":0.0,"x":0.0,"y":0.0,"z":0.0})");
  EXPECT_THAT(sent("geometry_msgs/msg/PoseArray", "{poses: [{}, {position: {y: 2}}]}"),
              testing::ContainsRegex("w.:1.0.*w.:1.0"));
  EXPECT_THAT([&] { sent("geometry_msgs/msg/Quaternion", "{x: 1, x: 2}"); },
              ThrowsMessage<Error>(HasSubstr("'x': it is given twice")));
}

TEST_F(Installed, APartOfAServiceIsKnownByItsFile) {
  write("srv/Turn.srv", "float64 angle\n---\n");
  const DescribedTypes types(defined("my_msgs/srv/Turn").value());
  EXPECT_EQ(
      read_message(*types.find("my_msgs/srv/Turn_Request"),
                   write_message(*types.find("my_msgs/srv/Turn_Request"), "{angle: 2}").bytes())
          .dump(),
      R"({"angle":2.0})");
  EXPECT_TRUE(types.find("my_msgs/srv/Turn_Response")->fields.empty());
}

TEST_F(Installed, WhatLacksATypeIsNotDefined) {
  write("msg/Leg.msg", "other_msgs/Foot foot\n");
  EXPECT_FALSE(defined("my_msgs/msg/Leg"));
  EXPECT_FALSE(defined("my_msgs/msg/Arm"));
  EXPECT_FALSE(defined("../my_msgs/msg/Leg"));
}

TEST_F(Installed, WrongLinesAreRefused) {
  write("msg/Leg.msg", "uint8\n");
  EXPECT_THAT(
      [] { defined("my_msgs/msg/Leg"); },
      ThrowsMessage<Error>(HasSubstr("the definition of my_msgs/msg/Leg has a line 'uint8'")));
}

}  // namespace
}  // namespace takt::tools
