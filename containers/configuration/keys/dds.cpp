// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_dds(const Value& value) {
  DdsOptions& dds = system_.dds.emplace();
  std::string threads;
  read_map(
      value, "dds",
      {{"domain",
        "Only processes of one domain see each other. Without it, that of the environment "
        "variable `ROS_DOMAIN_ID`, else 0.",
        into_domain(dds.domain)},
       {"loopback_only",
        "Talk over the loopback interface only; what comes by another is dropped. Without it, "
        "Cyclone's sockets receive from all interfaces.",
        into(dds.loopback_only)},
       {"parameter_services", "Containers answer ROS 2's parameter services: six for each node.",
        into(dds.parameter_services)},
       {"ros_graph",
        "In whose form ROS 2 is told of the nodes here: `jazzy` (since Iron) or `humble` (and "
        "before). `off`: others see topics and services, but no nodes.",
        into(dds.ros_graph,
             {{"jazzy", RosGraph::jazzy}, {"humble", RosGraph::humble}, {"off", RosGraph::off}})},
       {"rosout", "What is logged goes to ROS 2's topic `/rosout` too.", into(dds.rosout)},
       {"shared_memory",
        "Whether messages of fixed size go to other processes by shared memory. `auto`: when an "
        "iox-roudi runs that this user can use, else by UDP. `require`: `takt run` starts one "
        "when none runs, and what cannot be had is an error. See "
        "[zero copy](../how_to/zero_copy.md).",
        into(dds.shared_memory, {{"auto", SharedMemory::automatic},
                                 {"require", SharedMemory::require},
                                 {"off", SharedMemory::off}})},
       {"synchronized_clocks",
        "Other hosts keep the same time as this one, by PTP: latencies and deadlines of their "
        "messages begin when they were sent. Otherwise they begin on arrival.",
        into(dds.synchronized_clocks)},
       {"threads",
        "Name in `threads`: policy, priority and CPUs of all of Cyclone's threads; without it, "
        "SCHED_OTHER. They keep Cyclone's names; the result shows what is in force. Not "
        "SCHED_DEADLINE, which they cannot inherit.",
        [&](const Value& name) {
          into(threads)(name);
          if (!threads.empty()) dds.threads = find_thread(name.line, threads);
          errors_.passes(name.line, [&] { dds.check(); });
        }},
       {"security",
        "DDS Security: who this process is, what it may do, and what is encrypted. Without it, "
        "whoever is on the domain may read and write everything.",
        [&](const Value& security) { read_security(security, dds.security.emplace()); }}});
}

void ConfigurationReader::read_security(const Value& value, DdsSecurity& security) {
  const PemFile certificate{"BEGIN CERTIFICATE", "a certificate in PEM form"};
  const PemFile key{"PRIVATE KEY", "a private key in PEM form, without a password"};
  const PemFile document{"multipart/signed", "a document that `openssl smime -sign` has signed"};
  read_map(
      value, "security",
      {{"identity_ca", "The certificate of who has signed those of all processes.",
        into_file(security.identity_ca, certificate), true},
       {"certificate", "That of this process.", into_file(security.certificate, certificate), true},
       {"private_key", "Of that certificate, without a password, and not for every user to read.",
        into_file(security.private_key, key), true},
       {"permissions_ca",
        "The certificate of who has signed the next two. Without it, `identity_ca`.",
        into_file(security.permissions_ca, certificate)},
       {"governance", "What is protected, and how: the same for all of a domain. Signed.",
        into_file(security.governance, document), true},
       {"permissions",
        "What may be written and read by whom, told by the subject of the certificate. "
        "Signed.",
        into_file(security.permissions, document), true}});
  if (security.permissions_ca.empty()) security.permissions_ca = security.identity_ca;
  if (!security.certificate.empty() && !security.private_key.empty()) {
    passes(value, "private_key", [&] { security.check(); });
  }
}

// A file of this kind; a relative path begins in the folder of this file. Cyclone refuses a wrong
// one too, but does not tell which.
SystemReader::Read ConfigurationReader::into_file(std::string& path, PemFile wanted) {
  return into_checked(path, [this, &path, wanted] {
    const std::string file = beside(path);
    std::error_code none;
    std::ifstream stream;
    if (std::filesystem::is_regular_file(file, none)) stream.open(file, std::ios::binary);
    if (!stream.is_open()) {
      throw Error(fmt::format("there is no file '{}' that can be read", path),
                  fmt::format("name {}", wanted.kind));
    }
    std::string begin(1 << 16, '\0');
    stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    if (begin.find(wanted.mark) == std::string::npos) {
      throw Error(fmt::format("there is no '{}' in '{}'", wanted.mark, path),
                  fmt::format("name {}", wanted.kind));
    }
    path = file;
  });
}

// Its default is the environment's, which is no part of the reference.
SystemReader::Read ConfigurationReader::into_domain(int& domain) {
  return without_default([this, &domain] { return into(domain, 0, 230); });
}

}  // namespace takt
