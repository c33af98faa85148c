// What Cyclone DDS alone takes, without Takt: a participant with the endpoints of so many empty
// nodes, of which footprint.py measures the memory. CYCLONEDDS_URI configures it.
//   usage: footprint_cyclone NODES
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <iostream>
#include <string>

#include <dds/dds.h>

namespace {

struct String {
  char* data;
};

constexpr std::uint32_t kOperations[] = {
    static_cast<std::uint32_t>(DDS_OP_ADR) | static_cast<std::uint32_t>(DDS_OP_TYPE_STR), 0,
    DDS_OP_RTS};
constexpr dds_topic_descriptor_t kString{.m_size = sizeof(String),
                                         .m_align = alignof(String),
                                         .m_typename = "std_msgs::msg::dds_::String_",
                                         .m_nops = 2,
                                         .m_ops = kOperations};

dds_entity_t must(dds_entity_t result, const char* what) {
  if (result < 0) {
    std::cerr << what << ": " << dds_strretcode(-result) << std::endl;
    std::exit(1);
  }
  return result;
}

}  // namespace

int main(int, char** words) {
  const char* const number = std::getenv("ROS_DOMAIN_ID");
  const auto domain = static_cast<dds_domainid_t>(number != nullptr ? std::atoi(number) : 0);
  const dds_entity_t participant =
      must(dds_create_participant(domain, nullptr, nullptr), "participant");
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const auto topic = [&](const std::string& name) {
    return must(dds_create_topic(participant, &kString, name.c_str(), nullptr, nullptr), "topic");
  };
  const auto write = [&](const std::string& name) {
    must(dds_create_writer(participant, topic(name), qos, nullptr), "writer");
  };
  const auto read = [&](const std::string& name) {
    must(dds_create_reader(participant, topic(name), qos, nullptr), "reader");
  };
  write("ros_discovery_info");
  for (int node = 0; node < std::atoi(words[1]); ++node) {
    write("rt/rosout");
    write("rt/parameter_events");
    for (const char* service :
         {"describe_parameters", "get_parameter_types", "get_parameters", "list_parameters",
          "set_parameters", "set_parameters_atomically", "get_type_description"}) {
      const std::string name = "/node_" + std::to_string(node) + "/" + service;
      read("rq" + name + "Request");
      write("rr" + name + "Reply");
    }
  }
  dds_delete_qos(qos);
  std::cout << "ready" << std::endl;
  for (;;) dds_sleepfor(DDS_SECS(60));
}
