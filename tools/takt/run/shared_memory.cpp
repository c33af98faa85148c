// SPDX-License-Identifier: Apache-2.0
#include "run/shared_memory.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/measuring/json_text.hpp"

#include "exit_status.hpp"
#include "run/child_output.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

class NoWriter final : public RemoteWriter {
 public:
  std::size_t reader_count() const noexcept override { return 0; }
  WallTime stamp() const noexcept override { return {}; }
  void write(const void*, WallTime) noexcept override {}
  MessageBlock* lend(const void*) noexcept override { return nullptr; }
  void write_lent(MessageBlock&, WallTime) noexcept override {}
  void assert_liveliness() noexcept override {}
  bool wait_for_acks(Nanoseconds) noexcept override { return true; }
};

class NoReader final : public RemoteReader {
 public:
  std::size_t writer_count() const noexcept override { return 0; }
  std::uint64_t received() const noexcept override { return 0; }
};

/// A transport that creates no endpoints, and records the shared memory that they would need.
class Surveyor final : public Participant {
 public:
  std::unique_ptr<RemoteWriter> create_writer(const Endpoint& endpoint,
                                              std::shared_ptr<EndpointEvents>) override {
    note(endpoint, kChunksOfWriter);
    return std::make_unique<NoWriter>();
  }
  std::unique_ptr<RemoteReader> create_reader(IntraProcessReader& reader) override {
    const Endpoint& endpoint = reader.endpoint();
    note(endpoint, chunks_of_reader(endpoint.qos.depth, endpoint.type->size));
    return std::make_unique<NoReader>();
  }
  bool serves_own_process() const noexcept override { return false; }
  const std::string& why_no_shared_memory() const noexcept override { return nothing_; }
  std::vector<EndpointState> endpoints() const override { return {}; }
  void visit_endpoints(const std::function<void(const Endpoint&)>&) const override {}
  void add_node(const std::string&) override {}
  void remove_node(const std::string&) override {}
  Graph graph() override { return {}; }
  const std::vector<ThreadState>& threads() const noexcept override { return threads_; }

  const json& pools() const noexcept { return pools_; }

 private:
  void note(const Endpoint& endpoint, std::size_t chunks) {
    if (endpoint.type->fixed_size) pools_.push_back({endpoint.type->size, chunks});
  }

  const std::string nothing_;
  const std::vector<ThreadState> threads_;
  json pools_ = json::array();
};

json survey(const std::vector<SystemDescription>& processes, const ContainerOverrides& overrides) {
  try {
    const auto surveyor = std::make_shared<Surveyor>();
    ContainerOverrides surveyed = overrides;
    surveyed.participant = surveyor;
    for (const SystemDescription& process : processes) const Container container(process, surveyed);
    return {{"pools", surveyor->pools()}};
  } catch (const std::exception& error) {
    return {{"error", error.what()}};
  } catch (...) {
    return {{"error", "a component threw an object that is not a std::exception"}};
  }
}

/// Runs `survey` in a child process, so that side effects of the components end with it.
json survey_apart(const std::vector<SystemDescription>& processes,
                  const ContainerOverrides& overrides) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error("cannot create a pipe: " + errno_message(errno));
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // a signal ends the parent at once
    if (getppid() != parent) _exit(1);
    const std::string text = rt::json_text(survey(processes, overrides));
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t now = write(ends[1], text.data() + done, text.size() - done);
      if (now <= 0) break;
      done += static_cast<std::size_t>(now);
    }
    _exit(0);
  }
  close(ends[1]);
  ChildOutput output(pid, ends[0]);
  while (output.wait(std::chrono::hours(1))) {
  }
  waitpid(pid, nullptr, 0);
  json said = rt::json_or_null(output.text());
  if (said.is_null()) {
    throw Error("the process that constructs the components once to size shared memory has died",
                "check that the components work without shared memory");
  }
  return said;
}

}  // namespace

std::unique_ptr<RoudiProcess> start_roudi(const std::vector<SystemDescription>& processes,
                                          const ContainerOverrides& overrides) {
  const bool is_required =
      std::any_of(processes.begin(), processes.end(), [](const SystemDescription& process) {
        return process.dds && process.dds->shared_memory == SharedMemory::require;
      });
  if (!is_required) return nullptr;
  begin_work();
  return std::make_unique<RoudiProcess>([&] {
    const json said = survey_apart(processes, overrides);
    if (said.contains("error")) {
      throw ConfigurationError(std::vector<std::string>{said.at("error")});
    }
    std::vector<ChunkPool> pools;
    for (const json& pool : said.at("pools")) pools.push_back({pool.at(0), pool.at(1)});
    return pools;
  });
}

}  // namespace takt::tools
