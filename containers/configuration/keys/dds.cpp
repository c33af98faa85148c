// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <span>

#include <fmt/format.h>

#include "takt/base/regular_file.hpp"
#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void DdsReader::read(const Value& value) {
  // Only if the file names no domain, that of the environment applies, and may be wrong.
  DdsOptions& dds = system_.dds.emplace(
      document::find(value, "domain") != nullptr ? DdsOptions{.domain = 0} : DdsOptions{});
  std::string threads;
  read_map(
      value, "dds",
      {{"domain",
        "Only processes on the same domain discover each other. By default, the value of the "
        "environment variable `ROS_DOMAIN_ID`, else 0.",
        into_domain(dds.domain)},
       {"diagnostics",
        "Publish how executors, callbacks and chains do on ROS 2's topic `/diagnostics`, once a "
        "second while somebody subscribes to it.",
        into(dds.diagnostics, {{"on", true}, {"off", false}})},
       {"discovery",
        "Which processes are discovered. `localhost`: those of this machine, ROS 2's included; "
        "`subnet`: also those that multicast reaches; `off`: none, so no topic may have ends in "
        "two containers; `system`: as Cyclone's defaults and `CYCLONEDDS_URI` say; `lo`: those of "
        "this machine that use the loopback interface, "
        "which excludes ROS 2, and packets from other interfaces are dropped. By default, the "
        "value of the environment variable `ROS_AUTOMATIC_DISCOVERY_RANGE`, else `localhost`.",
        into_discovery(dds.discovery)},
       {"parameter_services",
        "Offer ROS 2's six parameter services, and `get_type_description`, for each node.",
        into(dds.parameter_services)},
       {"ros_graph",
        "Format in which nodes are announced to ROS 2: `jazzy` (Iron and later) or `humble` (and "
        "earlier). `off`: other processes see topics and services, but no nodes.",
        into(dds.ros_graph,
             {{"jazzy", RosGraph::jazzy}, {"humble", RosGraph::humble}, {"off", RosGraph::off}})},
       {"rosout", "Publish log lines on ROS 2's topic `/rosout`, too.", into(dds.rosout)},
       {"shared_memory",
        "Whether messages of fixed size go to other processes by shared memory. `auto`: if an "
        "iox-roudi runs that this user may use, else by UDP. `require`: `takt run` starts an "
        "iox-roudi if none runs, and fails without shared memory. See "
        "[zero copy](../how_to/zero_copy.md).",
        into(dds.shared_memory, {{"auto", SharedMemory::automatic},
                                 {"require", SharedMemory::require},
                                 {"off", SharedMemory::off}})},
       {"synchronized_clocks",
        "The clocks of all hosts are synchronised, for example by PTP. Then latencies and "
        "deadlines of messages from other hosts start at publication, otherwise at arrival.",
        into(dds.synchronized_clocks)},
       {"threads",
        "Name in `threads`: policy, priority and CPUs of all Cyclone threads; by default "
        "SCHED_OTHER. They keep Cyclone's names; results show the attributes in force. "
        "SCHED_DEADLINE is an error, because threads cannot inherit it.",
        [&](const Value& name) {
          into(threads)(name);
          if (!threads.empty()) dds.threads = file_.threads.find(threads, name.line);
          errors_.passes(name.line, [&] { dds.check(); });
        }},
       {"security",
        "DDS Security: identity and permissions of this process, and encryption. Without it, every "
        "process on the domain may read and write everything.",
        [&](const Value& security) { read_security(security, dds.security.emplace()); }}});
}

void DdsReader::read_security(const Value& value, DdsSecurity& security) {
  const PemFile certificate{"BEGIN CERTIFICATE", "a certificate in PEM form"};
  const PemFile key{"PRIVATE KEY", "a private key in PEM form, without a password"};
  const PemFile document{"multipart/signed", "a document signed by `openssl smime -sign`"};
  read_map(
      value, "security",
      {{"identity_ca",
        "Certificate of the authority that signed the certificates of all processes.",
        into_file(security.identity_ca, certificate), true},
       {"certificate", "Certificate of this process.", into_file(security.certificate, certificate),
        true},
       {"private_key",
        "Private key of this certificate, without a password. Other users must not be able to read "
        "it.",
        into_file(security.private_key, key), true},
       {"permissions_ca",
        "Certificate of the authority that signed the next two files. By default, `identity_ca`.",
        into_file(security.permissions_ca, certificate)},
       {"governance",
        "What is protected, and how. Signed, and the same for all processes of a domain.",
        into_file(security.governance, document), true},
       {"permissions",
        "What each process may write and read, by the subject of its certificate. Signed.",
        into_file(security.permissions, document), true}});
  if (security.permissions_ca.empty()) security.permissions_ca = security.identity_ca;
  if (!security.certificate.empty() && !security.private_key.empty()) {
    passes(value, "private_key", [&] { security.check(); });
  }
}

// Checks the kind of the file here, because Cyclone's error does not name the wrong file.
SystemReader::Read DdsReader::into_file(std::string& path, PemFile wanted) {
  return into_checked(path, [this, &path, wanted] {
    const std::string file = beside(path);
    std::string begin(1 << 16, '\0');
    try {
      RegularFile(file).read(0, std::as_writable_bytes(std::span(begin)));
    } catch (const Error&) {
      throw Error(fmt::format("'{}' is not a readable file", path),
                  fmt::format("name {}", wanted.kind));
    }
    if (begin.find(wanted.mark) == std::string::npos) {
      throw Error(fmt::format("there is no '{}' in '{}'", wanted.mark, path),
                  fmt::format("name {}", wanted.kind));
    }
    path = file;
  });
}

// The default domain depends on the environment, so the reference must not show it.
SystemReader::Read DdsReader::into_domain(int& domain) {
  return without_default([this, &domain] { return into(domain, 0, 230); });
}

SystemReader::Read DdsReader::into_discovery(DiscoveryRange& discovery) {
  return without_default([this, &discovery] {
    return into(discovery, {{"localhost", DiscoveryRange::localhost},
                            {"subnet", DiscoveryRange::subnet},
                            {"off", DiscoveryRange::off},
                            {"system", DiscoveryRange::system},
                            {"lo", DiscoveryRange::lo}});
  });
}

}  // namespace takt
