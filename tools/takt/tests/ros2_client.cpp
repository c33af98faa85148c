// Clients of ROS 2 as a service sees them: Cyclone without Takt. Each is made, waits until both
// topics have matched, as wait_for_service of rmw_cyclonedds does, and asks at once.
//   usage: ros2_client NODE CALLS    prints how many responses of NODE/list_parameters were lost
// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>

#include <dds/dds.h>

namespace {

struct Strings {
  std::uint32_t maximum, length;
  char** buffer;
  bool release;
};
struct Request {  // with the header that rmw_cyclonedds sends
  std::uint64_t client;
  std::int64_t number;
  Strings prefixes;
  std::uint64_t depth;
};
struct Response {
  std::uint64_t client;
  std::int64_t number;
  Strings names, prefixes;
};

constexpr auto kWord =
    static_cast<std::uint32_t>(DDS_OP_ADR) | static_cast<std::uint32_t>(DDS_OP_TYPE_8BY);
constexpr auto kStrings = static_cast<std::uint32_t>(DDS_OP_ADR) |
                          static_cast<std::uint32_t>(DDS_OP_TYPE_SEQ) |
                          static_cast<std::uint32_t>(DDS_OP_SUBTYPE_STR);
constexpr std::uint32_t kRequestOperations[] = {
    kWord,     offsetof(Request, client),   kWord, offsetof(Request, number),
    kStrings,  offsetof(Request, prefixes), kWord, offsetof(Request, depth),
    DDS_OP_RTS};
constexpr std::uint32_t kResponseOperations[] = {
    kWord,     offsetof(Response, client), kWord,    offsetof(Response, number),
    kStrings,  offsetof(Response, names),  kStrings, offsetof(Response, prefixes),
    DDS_OP_RTS};
constexpr dds_topic_descriptor_t kRequest{
    .m_size = sizeof(Request),
    .m_align = alignof(Request),
    .m_typename = "rcl_interfaces::srv::dds_::ListParameters_Request_",
    .m_nops = 5,
    .m_ops = kRequestOperations};
constexpr dds_topic_descriptor_t kResponse{
    .m_size = sizeof(Response),
    .m_align = alignof(Response),
    .m_typename = "rcl_interfaces::srv::dds_::ListParameters_Response_",
    .m_nops = 5,
    .m_ops = kResponseOperations};

dds_entity_t must(dds_entity_t result, const char* what) {
  if (result < 0) {
    std::cerr << what << ": " << dds_strretcode(-result) << std::endl;
    std::exit(1);
  }
  return result;
}

/// Until the condition holds, for five seconds at most.
template <class Condition>
bool wait_for(Condition&& condition) {
  const dds_time_t end = dds_time() + DDS_SECS(5);
  while (!condition()) {
    if (dds_time() > end) return false;
    dds_sleepfor(DDS_USECS(100));
  }
  return true;
}

class Participant {
 public:
  explicit Participant(int domain)
      : handle_(must(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr),
                     "dds_create_participant")) {}
  ~Participant() { dds_delete(handle_); }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  dds_entity_t topic(const dds_topic_descriptor_t& type, const std::string& name) const {
    return must(dds_create_topic(handle_, &type, name.c_str(), nullptr, nullptr), "topic");
  }
  dds_entity_t handle() const { return handle_; }

 private:
  const dds_entity_t handle_;
};

class Client {
 public:
  Client(const Participant& participant, const std::string& service, std::uint64_t number)
      : number_(number) {
    const dds_entity_t requests = participant.topic(kRequest, "rq" + service + "Request"),
                       responses = participant.topic(kResponse, "rr" + service + "Reply");
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    char id[64];
    const auto length =
        std::snprintf(id, sizeof id, "clientid=%02x.%02x.0.0.0.0.0.0.0.0.0.0.0.0.0.0;",
                      unsigned(number & 0xff), unsigned(number >> 8 & 0xff));
    dds_qset_userdata(qos, id, static_cast<std::size_t>(length));
    reader_ =
        must(dds_create_reader(participant.handle(), responses, qos, nullptr), "dds_create_reader");
    writer_ =
        must(dds_create_writer(participant.handle(), requests, qos, nullptr), "dds_create_writer");
    dds_delete_qos(qos);
  }

  bool finds_service() const {
    return wait_for([this] {
      dds_publication_matched_status_t readers;
      dds_subscription_matched_status_t writers;
      must(dds_get_publication_matched_status(writer_, &readers), "matched");
      must(dds_get_subscription_matched_status(reader_, &writers), "matched");
      return readers.current_count > 0 && writers.current_count > 0;
    });
  }
  bool gets_response() const {
    const Request request{number_, 1, {}, 0};
    must(dds_write(writer_, &request), "dds_write");
    return wait_for([this] {
      void* samples[1] = {nullptr};
      dds_sample_info_t info;
      bool is_mine = false;
      while (dds_take(reader_, samples, &info, 1, 1) > 0) {
        is_mine |= info.valid_data && static_cast<Response*>(samples[0])->client == number_;
        dds_return_loan(reader_, samples, 1);
      }
      return is_mine;
    });
  }

 private:
  const std::uint64_t number_;
  dds_entity_t reader_ = 0, writer_ = 0;
};

}  // namespace

int main(int, char** argv) {
  const std::string service = std::string(argv[1]) + "/list_parameters";
  const char* domain = std::getenv("ROS_DOMAIN_ID");
  int lost = 0;
  for (int i = 1; i <= std::atoi(argv[2]); ++i) {
    const Participant participant(domain != nullptr ? std::atoi(domain) : 0);
    const Client client(participant, service, static_cast<std::uint64_t>(i));
    if (!client.finds_service()) {
      std::cerr << "there is no service " << service << std::endl;
      return 1;
    }
    lost += client.gets_response() ? 0 : 1;
  }
  std::cout << lost << std::endl;
}
