// Every type of ROS 2's packages against what ROS 2 Jazzy has: type hash, and a sample as bytes.
// SPDX-License-Identifier: Apache-2.0
#include "ros_types.hpp"

#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "takt/messages/type_description.hpp"

namespace takt {
namespace {

using nlohmann::json;

/// Gives a message the values of a sample.
class Filler {
 public:
  Filler(const MessageType& type, const json& values) : type_(type), values_(values) {}
  template <class T>
  void operator()(T& field) {
    set(field, values_.at(type_.fields.at(next_++).name));
  }
  void no_fields() {}

 private:
  template <CdrPrimitive T>
  void set(T& field, const json& value) {
    field = value.get<T>();
  }
  void set(std::string& field, const json& value) { field = value.get<std::string>(); }
  template <class Container, std::size_t kMost>
  void set(Bounded<Container, kMost>& field, const json& value) {
    Container plain;
    set(plain, value);
    field = std::move(plain);
  }
  template <class T>
  void set(std::vector<T>& field, const json& values) {
    for (const json& value : values) {
      T element{};
      set(element, value);
      field.push_back(std::move(element));
    }
  }
  template <class T, std::size_t N>
  void set(std::array<T, N>& field, const json& values) {
    ASSERT_EQ(values.size(), N);
    for (std::size_t i = 0; i < N; ++i) set(field[i], values[i]);
  }
  template <Message T>
  void set(T& message, const json& values) {
    Filler filler(message_type<T>(), values);
    takt_visit_fields(filler, message);
  }

  const MessageType& type_;
  const json& values_;
  std::size_t next_ = 0;
};

std::vector<std::byte> bytes_of(const std::string& hex) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

template <class T>
void expect_sample(const json& sample) {
  const MessageType& type = message_type<T>();
  SCOPED_TRACE(type.name);
  T message;
  Filler filler(type, sample.at("values"));
  takt_visit_fields(filler, message);
  const std::vector<std::byte> theirs = bytes_of(sample.at("cdr_hex"));
  ByteBuffer ours;
  type.encode(&message, ours);
  EXPECT_TRUE(std::ranges::equal(ours.bytes(), theirs));
  T back;
  EXPECT_TRUE(type.decode(theirs, &back));
  EXPECT_EQ(back, message);
}

struct Known {
  const MessageType* type;
  void (*expect_sample)(const json&);
};
template <class T>
void add(std::map<std::string, Known>& all) {
  all[message_type<T>().name] = {&message_type<T>(), &expect_sample<T>};
}
std::map<std::string, Known> shipped() {
  std::map<std::string, Known> all;
#define TAKT_ADD(T) add<T>(all);
  TAKT_ROS_TYPES(TAKT_ADD)
#undef TAKT_ADD
  return all;
}

/// "Request" of "rcl_interfaces/srv/GetParameters".
std::string part_of(const std::string& name, const std::string& part) {
  return name.find("/msg/") != std::string::npos ? name : name + "_" + part;
}

TEST(RosTypes, AreThoseOfRos2) {
  const std::map<std::string, Known> all = shipped();
  const json theirs = json::parse(std::ifstream(TAKT_ROS_TYPES_FILE));
  ASSERT_GT(theirs.size(), 150u);
  for (const auto& [name, known] : theirs.items()) {
    SCOPED_TRACE(name);
    for (const auto& [part, sample] : known.at("samples").items()) {
      ASSERT_TRUE(all.contains(part_of(name, part)));
      all.at(part_of(name, part)).expect_sample(sample);
    }
    const std::string hash = known.at("hash");
    if (name.find("/msg/") != std::string::npos) {
      EXPECT_EQ(type_hash(*all.at(name).type), hash);
    } else if (name.find("/srv/") != std::string::npos) {
      EXPECT_EQ(
          service_type_hash(*all.at(name + "_Request").type, *all.at(name + "_Response").type),
          hash);
    }
  }
}

// There is no data of ROS 2's for this package; these bytes are written by hand (XCDR1).
TEST(RosTypes, OfDiagnosticsAreTheirBytes) {
  diagnostic_msgs::msg::DiagnosticArray array;
  array.header.stamp.set__sec(1).set__nanosec(2);
  array.header.frame_id = "ab";
  auto& status = array.status.emplace_back();
  status.level = diagnostic_msgs::msg::DiagnosticStatus::ERROR;
  status.name = "n";
  status.values.emplace_back().set__key("k").set__value("v");
  const std::vector<std::byte> bytes = bytes_of(
      "00010000010000000200000003000000616200000100000002000000020000006e000000010000000000000001"
      "0000000000000001000000020000006b000000020000007600");
  const MessageType& type = message_type<diagnostic_msgs::msg::DiagnosticArray>();
  ByteBuffer ours;
  type.encode(&array, ours);
  EXPECT_TRUE(std::ranges::equal(ours.bytes(), bytes));
  diagnostic_msgs::msg::DiagnosticArray back;
  EXPECT_TRUE(type.decode(bytes, &back));
  EXPECT_EQ(back, array);
}

TEST(RosTypes, HaveConstantsAndDefaultValues) {
  static_assert(diagnostic_msgs::msg::DiagnosticStatus::ERROR == 2);
  static_assert(action_msgs::msg::GoalStatus::STATUS_ABORTED == 6);
  static_assert(sensor_msgs::msg::NavSatStatus::STATUS_NO_FIX == -1);
  EXPECT_EQ(geometry_msgs::msg::Quaternion().w, 1);
  EXPECT_EQ(geometry_msgs::msg::Pose(MessageInitialization::ZERO).orientation.w, 0);
}

}  // namespace
}  // namespace takt
