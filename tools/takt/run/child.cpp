// SPDX-License-Identifier: Apache-2.0
#include "run/child.hpp"

#include <array>
#include <chrono>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include "commands.hpp"
#include "run/channel.hpp"
#include "run/container_json.hpp"
#include "run/end_signals.hpp"
#include "run/progress.hpp"
#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kMatchLimit = 10s;

/// Waits until each end of a topic has found as many others as the parent has counted.
void wait_for_matches(const Container& container, const json& wanted) {
  const TimePoint limit = Clock::steady().now() + kMatchLimit;
  for (;;) {
    const std::vector<EndpointState> endpoints = container.endpoints();
    const EndpointState* lonely = nullptr;
    for (std::size_t i = 0; i < wanted.size() && lonely == nullptr; ++i) {
      if (endpoints.at(i).matched < wanted[i].get<std::size_t>()) lonely = &endpoints[i];
    }
    if (lonely == nullptr) return;
    if (Clock::steady().now() > limit) {
      throw Error(fmt::format("topic '{}': a {} has found {} of its partners in other processes "
                              "after {} s",
                              lonely->topic, lonely->is_writer ? "publisher" : "subscription",
                              lonely->matched, kMatchLimit.count()),
                  "is another program on the same DDS domain, or a firewall on lo?");
    }
    std::this_thread::sleep_for(2ms);
  }
}

}  // namespace

int serve(const SystemDescription& system, ContainerOverrides overrides, int socket) {
  Channel parent(socket);
  try {
    const int failed = eventfd(0, EFD_CLOEXEC);
    EndGuard guard;  // the parent looks after the beginning
    overrides.on_making = [&guard](std::string_view component) { guard.making(component); };
    Container container(system, overrides);
    const bool serves_itself = system.dds && system.dds->serves_own_process;
    const auto ends = [&]() -> json {
      return {{"endpoints", endpoints_json(container)},
              {"nodes", nodes_json(container)},
              {"serves_itself", serves_itself}};
    };
    parent.send(ends());
    TimePoint check = kNever;
    for (;;) {
      std::array<pollfd, 2> news{{{parent.fd(), POLLIN, 0}, {failed, POLLIN, 0}}};
      const TimePoint now = Clock::steady().now();
      if (now >= check) {
        container.check_matches();
        check = kNever;
      }
      const timespec time = to_timespec(check - now);
      ppoll(news.data(), news.size(), check == kNever ? nullptr : &time, nullptr);
      if (news[1].revents != 0) {
        guard.ends(0);
        container.hold();
        container.stop();  // throws what the callback threw
      }
      if (news[0].revents == 0) continue;
      const std::optional<json> command = parent.receive();
      if (!command) return 0;
      const std::string& word = command->at("do").get_ref<const std::string&>();
      json answer = json::object();
      if (word == "match") {
        wait_for_matches(container, command->at("wanted"));
      } else if (word == "start") {
        container.start([failed] { eventfd_write(failed, 1); });
      } else if (word == "release") {
        container.release();
        check = Clock::steady().now() + kDiscoveryTime;
      } else if (word == "hold") {
        check = kNever;
        guard.ends(0);
        container.hold();
      } else if (word == "status") {
        answer = ends();
        answer["pending"] = container.pending();
      } else if (word == "shut_down") {
        container.shut_down();
      } else if (word == "stop") {
        container.stop();
        answer = {{"result", process_json(container.result())}};
      }
      parent.send(answer);
    }
  } catch (const std::exception& error) {
    Logger::instance().flush();
    parent.send({{"error", error.what()}});
  } catch (...) {
    Logger::instance().flush();
    parent.send({{"error", kNoStdException}});
  }
  return 1;
}

}  // namespace takt::tools
