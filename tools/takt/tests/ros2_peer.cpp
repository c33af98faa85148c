// A process of ROS 2 as its neighbours see it: Cyclone without Takt, configured as rmw_cyclonedds
// (Jazzy) configures it. It publishes std_msgs/String on /NAME, and hears /OTHER.
//   usage: ros2_peer RANGE NAME OTHER
//   lines: ready: are both ends matched? | publish: a message | heard: how many messages |
//   nodes NUMBER: after how many ms the nodes of so many other processes were known
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <iostream>
#include <set>
#include <sstream>
#include <string>

#include <dds/dds.h>
#include <unistd.h>

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

std::string configuration(const std::string& range) {
  std::string peers;
  std::istringstream addresses(
      std::getenv("ROS_STATIC_PEERS") != nullptr ? std::getenv("ROS_STATIC_PEERS") : "");
  if (range == "LOCALHOST") peers += "<Peer address='localhost'/>";
  for (std::string address; std::getline(addresses, address, ';');) {
    peers += "<Peer address='" + address + "'/>";
  }
  std::string discovery;
  if (range == "OFF") {
    discovery = "<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_" +
                std::to_string(getpid()) + "</Tag>";
  } else {
    discovery =
        "<ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>";
    if (!peers.empty()) discovery += "<Peers>" + peers + "</Peers>";
  }
  const bool multicast = range == "SUBNET";
  return std::string("<CycloneDDS><Domain>") +
         (multicast ? "" : "<General><AllowMulticast>false</AllowMulticast></General>") +
         "<Discovery>" + discovery + "</Discovery></Domain></CycloneDDS>";
}

dds_entity_t must(dds_entity_t result, const char* what) {
  if (result < 0) {
    std::cerr << what << ": " << dds_strretcode(-result) << std::endl;
    std::exit(1);
  }
  return result;
}

/// The nodes of a process: only its GUID is looked at.
struct Nodes {
  std::uint8_t gid[16];
};
constexpr std::uint32_t kNodesOperations[] = {static_cast<std::uint32_t>(DDS_OP_ADR) |
                                                  static_cast<std::uint32_t>(DDS_OP_TYPE_ARR) |
                                                  static_cast<std::uint32_t>(DDS_OP_SUBTYPE_1BY),
                                              0, 16, DDS_OP_RTS};
constexpr dds_topic_descriptor_t kNodes{
    .m_size = sizeof(Nodes),
    .m_align = alignof(Nodes),
    .m_typename = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
    .m_nops = 2,
    .m_ops = kNodesOperations};

/// Made with the participant, as rmw does.
dds_entity_t make_reader_of_nodes(dds_entity_t participant) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, DDS_LENGTH_UNLIMITED);
  const dds_entity_t topic =
      must(dds_create_topic(participant, &kNodes, "ros_discovery_info", nullptr, nullptr),
           "the topic of nodes");
  const dds_entity_t reader = must(dds_create_reader(participant, topic, qos, nullptr), "nodes");
  dds_delete_qos(qos);
  return reader;
}

/// After how many ms the nodes of so many processes were known.
double nodes_known_after(dds_entity_t reader, dds_time_t begin, std::size_t processes) {
  std::set<std::string> known;
  while (known.size() < processes) {
    void* samples[1] = {nullptr};
    dds_sample_info_t info;
    if (dds_take(reader, samples, &info, 1, 1) > 0) {
      if (info.valid_data) {
        known.emplace(reinterpret_cast<const char*>(static_cast<Nodes*>(samples[0])->gid), 16);
      }
      dds_return_loan(reader, samples, 1);
      continue;
    }
    if (dds_time() - begin > DDS_SECS(20)) std::exit(1);
    dds_sleepfor(DDS_MSECS(1));
  }
  return static_cast<double>(dds_time() - begin) / 1e6;
}

}  // namespace

int main(int, char** argv) {
  const std::string range = argv[1], topics = "rt/";
  const char* const number = std::getenv("ROS_DOMAIN_ID");
  const auto domain = static_cast<dds_domainid_t>(number != nullptr ? std::atoi(number) : 0);
  must(dds_create_domain(domain, configuration(range).c_str()), "dds_create_domain");
  const dds_time_t begin = dds_time();
  const dds_entity_t participant =
      must(dds_create_participant(domain, nullptr, nullptr), "dds_create_participant");
  const dds_entity_t nodes = make_reader_of_nodes(participant);
  const auto topic = [&](const char* name) {
    return must(dds_create_topic(participant, &kString, (topics + name).c_str(), nullptr, nullptr),
                "dds_create_topic");
  };
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t writer =
      must(dds_create_writer(participant, topic(argv[2]), qos, nullptr), "dds_create_writer");
  const dds_entity_t reader =
      must(dds_create_reader(participant, topic(argv[3]), qos, nullptr), "dds_create_reader");
  dds_delete_qos(qos);
  int heard = 0;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "ready") {
      dds_publication_matched_status_t readers;
      dds_subscription_matched_status_t writers;
      must(dds_get_publication_matched_status(writer, &readers), "matched");
      must(dds_get_subscription_matched_status(reader, &writers), "matched");
      std::cout << (readers.current_count > 0 && writers.current_count > 0);
    } else if (line == "publish") {
      char text[] = "hello";
      const String message{text};
      std::cout << must(dds_write(writer, &message), "dds_write");
    } else if (line.starts_with("nodes ")) {
      std::cout << nodes_known_after(nodes, begin, std::stoul(line.substr(6)));
    } else if (line == "heard") {
      for (;;) {
        void* samples[1] = {nullptr};
        dds_sample_info_t info;
        if (dds_take(reader, samples, &info, 1, 1) <= 0) break;
        heard += info.valid_data ? 1 : 0;
        dds_return_loan(reader, samples, 1);
      }
      std::cout << heard;
    }
    std::cout << std::endl;
  }
}
