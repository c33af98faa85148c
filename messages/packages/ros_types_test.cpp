// Every type of ROS 2's packages against what ROS 2 Jazzy has: type hash, and a sample as bytes.
// SPDX-License-Identifier: Apache-2.0
#include "ros_types.hpp"

#include <deque>
#include <fstream>
#include <map>
#include <regex>
#include <string>

#include <boost/locale/encoding_utf.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "takt/messages/described_types.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/type_description_service.hpp"
#include "takt/testing/outside.hpp"
#include "takt/testing/serve.hpp"

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
  void set(std::u16string& field, const json& value) {
    field = boost::locale::conv::utf_to_utf<char16_t>(value.get<std::string>());
  }
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
template <class... T>
std::map<std::string, Known> all_of() {
  std::map<std::string, Known> all;
  for (const Known& known : {Known{&message_type<T>(), &expect_sample<T>}...})
    all[known.type->name] = known;
  return all;
}
std::map<std::string, Known> shipped() {
  return all_of<TAKT_ROS_TYPES>();
}

/// "Request" of "rcl_interfaces/srv/GetParameters".
std::string part_of(const std::string& name, const std::string& part) {
  return name.find("/msg/") != std::string::npos ? name : name + "_" + part;
}

TEST(RosTypes, AreThoseOfRos2) {
  const std::map<std::string, Known> all = shipped();
  const json theirs = json::parse(std::ifstream(TAKT_ROS_TYPES_FILE));
  ASSERT_EQ(theirs.size(), 194u);
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
    } else {
      EXPECT_EQ(
          type_hash(*describe_action(*all.at(name + "_Goal").type, *all.at(name + "_Result").type,
                                     *all.at(name + "_Feedback").type)),
          hash);
    }
  }
}

/// A participant with endpoints of all types.
class AllTypes : public Outside {
 public:
  explicit AllTypes(const std::map<std::string, Known>& all) {
    for (const auto& [name, known] : all) {
      const auto ends_with = [&, known_name = name](const std::string& ending) {
        return known_name.ends_with(ending);
      };
      const std::string base = name.substr(0, name.rfind('_'));
      if (name.find("/msg/") != std::string::npos) {
        add(*known.type);
      } else if (ends_with("_Request")) {
        add(*known.type, all.at(base + "_Response").type);
      } else if (ends_with("_Goal")) {
        add(make(base + "_SendGoal_Request", "goal", *known.type), known.type);
      } else if (ends_with("_Result")) {
        add(make(base + "_GetResult_Response", "result", *known.type));
      } else if (ends_with("_Feedback")) {
        add(make(base + "_FeedbackMessage", "feedback", *known.type));
      }
    }
  }
  void visit_endpoints(const std::function<void(const Endpoint&)>& visit) const override {
    for (const Endpoint& end : ends_) visit(end);
  }

 private:
  void add(const MessageType& type, const MessageType* response = nullptr) {
    ends_.push_back({.topic = "/topic", .type = &type, .qos = QoS(1), .node = "/node"});
    if (response != nullptr) ends_.back().identity = {"serviceid=1.1;", &type, response};
  }
  const MessageType& make(const std::string& name, const char* field, const MessageType& type) {
    return made_.emplace_back(MessageType{
        .name = name, .fields = {{.name = field, .shape = {FieldShape::nested, 0, 0, &type}}}});
  }

  std::deque<MessageType> made_;
  std::vector<Endpoint> ends_;
};

using type_description_interfaces::srv::GetTypeDescription;

/// As rosidl makes them: a source for the type and for each that it refers to, in their order. What
/// it makes for a service or an action, which is named after that, is implicit. Nothing has a file.
void expect_sources(const GetTypeDescription::Response& answer) {
  std::vector<std::string> names{answer.type_description.type_description.type_name.get()};
  for (const auto& type : answer.type_description.referenced_type_descriptions) {
    names.push_back(type.type_name.get());
  }
  ASSERT_EQ(answer.type_sources.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    SCOPED_TRACE(names[i]);
    EXPECT_EQ(answer.type_sources[i].type_name, names[i]);
    const bool is_implicit = std::regex_match(
        names[i], std::regex("\\w+/(srv/\\w+_(Request|Response|Event)|action/\\w+_"
                             "(Goal|Result|Feedback|FeedbackMessage|"
                             "(SendGoal|GetResult)(_(Request|Response|Event))?))"));
    EXPECT_EQ(answer.type_sources[i].encoding, is_implicit ? "implicit" : "dynamic");
    EXPECT_EQ(answer.type_sources[i].raw_file_contents, "");
  }
}

TEST(RosTypes, AreDescribedByTheService) {
  const auto participant = std::make_shared<AllTypes>(shipped());
  const auto node = std::make_shared<Node>("node", NodeOptions{.participant = participant});
  const TypeDescriptionService service(*node, *node);
  const auto server = node->entities().back();
  const auto asker = std::make_shared<Node>("asker");
  const auto client = asker->create_client<GetTypeDescription>("/node/get_type_description");
  const auto ask = [&](const std::string& name, const std::string& hash, bool with_sources) {
    GetTypeDescription::Response answer;
    client->async_send_request(
        GetTypeDescription::Request()
            .set__type_name(name)
            .set__type_hash(hash)
            .set__include_type_sources(with_sources),
        [&](const GetTypeDescription::Response* response) { answer = *response; });
    EXPECT_TRUE(serve(*server));
    EXPECT_TRUE(serve(*client));
    return answer;
  };
  const json theirs = json::parse(std::ifstream(TAKT_ROS_TYPES_FILE));
  for (const auto& [name, known] : theirs.items()) {
    SCOPED_TRACE(name);
    const auto answer = ask(name, known.at("hash"), true);
    EXPECT_EQ(answer.failure_reason, "");
    ASSERT_TRUE(answer.successful);
    EXPECT_EQ(answer.type_description.type_description.type_name.get(), name);
    EXPECT_EQ(type_hash(answer.type_description), known.at("hash"));
    const DescribedTypes types(answer.type_description);
    for (const auto& [part, sample] : known.at("samples").items()) {
      EXPECT_NE(types.find(part_of(name, part)), nullptr) << part;
    }
    expect_sources(answer);
    EXPECT_TRUE(ask(name, known.at("hash"), false).type_sources.empty());
  }
  const auto answer = ask("std_msgs/msg/String", "RIHS01_0", true);
  EXPECT_FALSE(answer.successful);
  EXPECT_EQ(answer.failure_reason,
            "no topic, service or action here has the type 'std_msgs/msg/String' with the hash "
            "'RIHS01_0'");
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
