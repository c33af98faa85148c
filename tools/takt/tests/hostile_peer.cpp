// Another user's process that means harm: Cyclone without Takt, so that nothing checks what it
// says. In turn it publishes on topics with wrong names, sends bytes at random to whatever reads on
// the domain, makes ends of wrong types on topics of others, floods the domain with ends, and asks
// services as clients that do not exist.
//   usage: hostile_peer DOMAIN SECONDS SEED
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

namespace {

using Bytes = std::vector<unsigned char>;
using namespace std::chrono_literals;

// ---- A type whose messages are any bytes ----

struct Data : ddsi_serdata {
  Bytes bytes;
};

Data* make_data(const ddsi_sertype* type, ddsi_serdata_kind kind) {
  auto* data = new Data;
  ddsi_serdata_init(data, type, kind);
  return data;
}

Data* of(const ddsi_serdata* data) {
  return const_cast<Data*>(static_cast<const Data*>(data));
}

const ddsi_serdata_ops kDataOperations = {
    .eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; },
    .get_size =
        [](const ddsi_serdata* data) { return static_cast<std::uint32_t>(of(data)->bytes.size()); },
    .from_ser = [](const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata*,
                   std::size_t) -> ddsi_serdata* { return make_data(type, kind); },
    .from_ser_iov = [](const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t,
                       const ddsrt_iovec_t*,
                       std::size_t) -> ddsi_serdata* { return make_data(type, kind); },
    .from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
      return make_data(type, SDK_KEY);
    },
    .from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind kind,
                      const void*) -> ddsi_serdata* { return make_data(type, kind); },
    .to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size,
                 void* to) { std::memcpy(to, of(data)->bytes.data() + offset, size); },
    .to_ser_ref = [](const ddsi_serdata* data, std::size_t offset, std::size_t size,
                     ddsrt_iovec_t* part) -> ddsi_serdata* {
      part->iov_base = of(data)->bytes.data() + offset;
      part->iov_len = static_cast<ddsrt_iov_len_t>(size);
      return ddsi_serdata_ref(data);
    },
    .to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); },
    .to_sample = [](const ddsi_serdata*, void*, void**, void*) { return true; },
    .to_untyped = [](const ddsi_serdata* data) -> ddsi_serdata* {
      Data* untyped = make_data(data->type, SDK_KEY);
      untyped->type = nullptr;
      return untyped;
    },
    .untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**,
                            void*) { return true; },
    .free = [](ddsi_serdata* data) { delete of(data); },
    .print = [](const ddsi_sertype*, const ddsi_serdata*, char*, std::size_t) -> std::size_t {
      return 0;
    },
    .get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash,
                      bool) { std::memset(hash, 0, sizeof *hash); },
    .get_sample_size = nullptr,
    .from_iox_buffer = nullptr};

const ddsi_sertype_ops kTypeOperations = {
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free =
        [](ddsi_sertype* type) {
          ddsi_sertype_fini(type);
          delete type;
        },
    .zero_samples = [](const ddsi_sertype*, void*, std::size_t) {},
    .realloc_samples =
        [](void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t count) {
          for (std::size_t i = 0; i < count; ++i) samples[i] = nullptr;
        },
    .free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {},
    .equal =
        [](const ddsi_sertype* one, const ddsi_sertype* other) {
          return !std::strcmp(one->type_name, other->type_name);
        },
    .hash = [](const ddsi_sertype*) -> std::uint32_t { return 1; },
    .type_id = nullptr,
    .type_map = nullptr,
    .type_info = nullptr,
    .derive_sertype = nullptr,
    .get_serialized_size = nullptr,
    .serialize_into = nullptr};

// ---- What it does ----

const std::vector<std::string> kWrongNames = {
    "rt/1abc", "rt/a//b",        "rt/a/",  "rt/",   "rt",           "rq/",
    "/",       "rt/\x1b[31mred", "rt/a b", "rt/..", "rt/\n9  9  9", "rt/%n%s"};
const std::vector<std::string> kWords = {
    "use_sim_time", "takt::Recorder", "/", "", "active", "../../x", "%n%s", "\x1b[2J", "robot"};

class Peer {
 public:
  Peer(std::uint32_t domain, std::uint32_t seed) : random_(seed) {
    dds_create_domain(
        domain,
        "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>"
        "<Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>");
    participant_ = dds_create_participant(domain, nullptr, nullptr);
    readers_ =
        dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr);
    qos_ = dds_create_qos();
    dds_qset_reliability(qos_, DDS_RELIABILITY_RELIABLE, DDS_MSECS(1));
    dds_qset_durability(qos_, DDS_DURABILITY_TRANSIENT_LOCAL);
  }

  bool is_there() const { return participant_ > 0 && readers_ > 0; }
  std::size_t victims() const { return victims_.size(); }
  unsigned long sent() const { return sent_; }
  unsigned long ends() const { return ends_; }

  void announce_wrong_names() {
    for (const std::string& name : kWrongNames) end(name, "std_msgs::msg::dds_::String_", true);
  }
  void find_victims() {
    void* samples[256] = {};
    static dds_sample_info_t infos[256];
    const int count = dds_read(readers_, samples, infos, 256, 256);
    for (int i = 0; i < count; ++i) {
      const auto& found = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      if (!infos[i].valid_data || victims_.contains(found.topic_name)) continue;
      const End writer = end(found.topic_name, found.type_name, true);
      if (writer.handle > 0) victims_.emplace(found.topic_name, writer);
    }
    if (count > 0) dds_return_loan(readers_, samples, count);
  }
  void send_garbage() {
    for (const auto& [topic, writer] : victims_) {
      send(writer, garbage(topic.starts_with("rq/") || topic.starts_with("rr/")));
    }
  }
  /// Valid requests, each of another client: Cyclone DDS has the client's id in the first 16 bytes.
  void ask_as_nobody() {
    for (const auto& [topic, writer] : victims_) {
      if (!topic.ends_with("/list_parametersRequest")) continue;
      Bytes request = {0, 1, 0, 0};
      for (int i = 0; i < 4; ++i) add(request, random_());
      for (int i = 0; i < 4; ++i) add(request, 0);
      send(writer, request);
    }
  }
  void use_wrong_types() {
    std::vector<dds_entity_t> made;
    for (const auto& [topic, writer] : victims_) {
      if (made.size() == 40) break;
      made.push_back(
          end(topic, "evil::msg::dds_::T" + std::to_string(random_() % 9) + "_", random_() % 2 == 0)
              .handle);
    }
    for (const dds_entity_t handle : made) dds_delete(handle);
  }
  void flood() {
    std::vector<dds_entity_t> made;
    for (int i = 0; i < 50; ++i) {
      const std::string name = "rt/flood" + std::to_string(ends_) + "/" + std::string(200, 'x');
      made.push_back(end(name, "std_msgs::msg::dds_::String_", i % 2 == 0).handle);
    }
    for (const dds_entity_t handle : made) dds_delete(handle);
  }

 private:
  struct End {
    dds_entity_t handle;
    ddsi_sertype* type;
  };

  End end(const std::string& name, const std::string& type_name, bool is_writer) {
    auto* type = new ddsi_sertype{};
    ddsi_sertype_init_flags(type, type_name.c_str(), &kTypeOperations, &kDataOperations,
                            DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
    type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
    const dds_entity_t topic =
        dds_create_topic_sertype(participant_, name.c_str(), &type, nullptr, nullptr, nullptr);
    if (topic < 0) return {topic, nullptr};
    const dds_entity_t made = is_writer ? dds_create_writer(participant_, topic, qos_, nullptr)
                                        : dds_create_reader(participant_, topic, qos_, nullptr);
    ends_ += made > 0 ? 1 : 0;
    return {made, type};
  }
  void send(const End& writer, const Bytes& bytes) {
    Data* data = make_data(writer.type, SDK_DATA);
    data->bytes = bytes;
    data->statusinfo = 0;
    data->timestamp.v = random_() % 10 == 0 ? static_cast<std::int64_t>(random_()) : dds_time();
    sent_ += dds_writecdr(writer.handle, data) == 0 ? 1 : 0;
  }
  static void add(Bytes& bytes, std::uint64_t number) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<unsigned char>(number >> (8 * i)));
  }
  // Numbers, lengths that lie, words, and ends in the middle.
  Bytes garbage(bool is_request) {
    Bytes bytes = {0, 1, 0, 0};
    for (auto& byte : bytes) {
      if (random_() % 50 == 0) byte = static_cast<unsigned char>(random_());
    }
    if (is_request) {
      for (int i = 0; i < 4; ++i) add(bytes, random_() % 2 == 0 ? random_() : 0);
    }
    for (auto parts = random_() % 20; parts > 0; --parts) {
      const std::string& word = kWords[random_() % kWords.size()];
      switch (random_() % 4) {
        case 0:
          add(bytes, random_() % 6);
          break;
        case 1:
          add(bytes, 0xffffffff - random_() % 8);
          break;
        case 2:
          add(bytes, word.size() + 1);
          bytes.insert(bytes.end(), word.c_str(), word.c_str() + word.size() + 1);
          break;
        default:
          while (bytes.size() % 4 != 0) bytes.push_back(0);
      }
    }
    if (random_() % 100 == 0) bytes.resize(random_() % 5);
    if (random_() % 2000 == 0) bytes.resize(1 << 20);
    return bytes;
  }

  std::mt19937_64 random_;
  dds_entity_t participant_, readers_;
  dds_qos_t* qos_;
  std::map<std::string, End> victims_;
  unsigned long sent_ = 0, ends_ = 0;
};

}  // namespace

int main(int, char** argv) {
  Peer peer(static_cast<std::uint32_t>(std::stoul(argv[1])),
            static_cast<std::uint32_t>(std::stoul(argv[3])));
  if (!peer.is_there()) return 1;
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(std::stod(argv[2]));
  peer.announce_wrong_names();
  for (unsigned round = 0; std::chrono::steady_clock::now() < end; ++round) {
    if (round % 100 == 0) peer.find_victims();
    peer.send_garbage();
    peer.ask_as_nobody();
    if (round % 50 == 10) peer.use_wrong_types();
    if (round % 50 == 20) peer.flood();
    std::this_thread::sleep_for(2ms);
  }
  std::cout << peer.victims() << " " << peer.sent() << " " << peer.ends() << std::endl;
  std::_Exit(0);  // its endpoints go as those of a process that was killed
}
