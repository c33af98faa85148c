// A process of ROS 2 as its neighbours see it: Cyclone without Takt, configured as rmw_cyclonedds
// (Jazzy) configures it. It publishes std_msgs/String on /NAME, and hears /OTHER.
//   usage: ros2_peer RANGE NAME OTHER
//   lines: ready: are both ends matched? | publish: a message | heard: how many messages |
//   found NUMBER: after how many ms so many other participants were found
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <iostream>
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

/// So many others than its own, which is also in the list.
double found_after(dds_entity_t participant, dds_time_t begin, int others) {
  const dds_entity_t reader =
      must(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
           "dds_create_reader");
  constexpr int kMost = 200;
  void* samples[kMost] = {};
  dds_sample_info_t infos[kMost];
  for (;;) {
    const dds_return_t found = dds_read(reader, samples, infos, kMost, kMost);
    if (found > 0) dds_return_loan(reader, samples, found);
    if (found > others) break;
    if (dds_time() - begin > DDS_SECS(20)) std::exit(1);
    dds_sleepfor(DDS_MSECS(1));
  }
  const auto after = static_cast<double>(dds_time() - begin) / 1e6;
  dds_delete(reader);
  return after;
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
    } else if (line.starts_with("found ")) {
      std::cout << found_after(participant, begin, std::atoi(line.c_str() + 6));
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
