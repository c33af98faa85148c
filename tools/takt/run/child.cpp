// SPDX-License-Identifier: Apache-2.0
#include "run/child.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include "takt/measuring/row_json.hpp"

#include "exit_status.hpp"
#include "run/channel.hpp"
#include "run/end_signals.hpp"
#include "run/latencies_over_time.hpp"
#include "run/process_state.hpp"
#include "run/progress.hpp"
#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kMatchLimit = 10s;

/// Waits until each publisher and subscription has discovered as many matching endpoints as the
/// parent has counted, or the parent has closed the connection: a signal may have ended the run.
void wait_for_matches(const Container& container, const json& wanted, const Channel& parent) {
  const TimePoint limit = later(Clock::steady().now(), kMatchLimit);
  for (;;) {
    const std::vector<EndpointState> endpoints = container.endpoints();
    const EndpointState* lonely = nullptr;
    for (std::size_t i = 0; i < wanted.size() && lonely == nullptr; ++i) {
      if (endpoints.at(i).matched < wanted[i].get<std::size_t>()) lonely = &endpoints[i];
    }
    if (lonely == nullptr) return;
    if (Clock::steady().now() > limit) {
      throw Error(
          fmt::format("topic '{}': a {} discovered {} of its matching endpoints in other processes "
                      "after {} s",
                      lonely->topic, lonely->is_writer ? "publisher" : "subscription",
                      lonely->matched, kMatchLimit.count()),
          "check for other programs on this DDS domain, and for a firewall on lo");
    }
    // The parent sends nothing before it has the answer.
    pollfd ended{parent.fd(), POLLRDHUP, 0};
    if (poll(&ended, 1, 2) > 0) return;
  }
}

/// A container controlled by the parent process.
class Child {
 public:
  Child(const SystemDescription& system, ContainerOverrides overrides, Channel& parent,
        EndGuard& guard)
      : parent_(parent),
        guard_(guard),
        slices_(overrides.slices),
        container_(system, with_guard(std::move(overrides))),
        serves_itself_(system.dds && system.dds->serves_own_process) {}

  /// Runs until the parent closes the connection, or a component ends the container. Rethrows an
  /// exception of a callback.
  void run() {
    parent_.send(state());
    for (;;) {
      const Event event = wait();
      if (event == Event::ended) return;
      if (event == Event::none) continue;
      const std::optional<json> command = parent_.receive();
      if (!command) return guard_.ends(guard_.signal());
      parent_.send(answer_to(*command));
    }
  }

 private:
  ContainerOverrides with_guard(ContainerOverrides overrides) {
    overrides.on_making = [this](std::string_view component) { guard_.making(component); };
    overrides.end = [ended = ended_] { eventfd_write(ended, 1); };
    return overrides;
  }

  json state() const { return rt::row_json(state_of(container_, serves_itself_)); }

  enum class Event { none, command, ended };

  Event wait() {
    std::array<pollfd, 2> events{{{parent_.fd(), POLLIN, 0}, {ended_, POLLIN, 0}}};
    const TimePoint now = Clock::steady().now();
    if (now >= check_) {
      container_.check_matches();
      check_ = kNever;
    }
    const timespec time = to_timespec(check_ - now);
    ppoll(events.data(), events.size(), check_ == kNever ? nullptr : &time, nullptr);
    if (events[1].revents != 0) {
      guard_.ends(0);
      container_.hold();
      container_.stop();  // throws what a callback has thrown
      return Event::ended;
    }
    return events[0].revents != 0 ? Event::command : Event::none;
  }

  json answer_to(const json& command) {
    const std::string& word = command.at("do").get_ref<const std::string&>();
    json answer = json::object();
    if (word == "match") {
      wait_for_matches(container_, command.at("wanted"), parent_);
    } else if (word == "start") {
      container_.start([ended = ended_] { eventfd_write(ended, 1); });
    } else if (word == "release") {
      container_.release();
      if (!command.value("is_first", false)) slices_.reset();  // of another time than others'
      guard_.has_begun();
      check_ = later(Clock::steady().now(), kDiscoveryTime);
    } else if (word == "hold") {
      check_ = kNever;
      guard_.ends(command.at("signal"));
      container_.hold();
    } else if (word == "status") {
      answer = state();
    } else if (word == "shut_down") {
      container_.shut_down();
    } else if (word == "stop") {
      container_.stop();
      ProcessResult result = container_.result();
      const std::vector<std::string> failed = std::move(result.failures);
      answer = {{"run", rt::run_json(rt::run_of(std::move(result)))},
                {"failed", failed},
                {"over_time", slices_json(slices_.get())}};
    }
    return answer;
  }

  Channel& parent_;
  EndGuard& guard_;
  const int ended_ =
      eventfd(0, EFD_CLOEXEC);  // an executor failed, or a component ends the container
  std::shared_ptr<LatencySlices> slices_;
  Container container_;
  const bool serves_itself_;
  TimePoint check_ = kNever;
};

}  // namespace

int serve(const SystemDescription& system, ContainerOverrides overrides, int socket,
          EndGuard& guard) {
  fcntl(socket, F_SETFD, FD_CLOEXEC);  // it came through exec, and goes no further
  Channel parent(socket);
  try {
    Child(system, std::move(overrides), parent, guard).run();
    return 0;
  } catch (const std::exception& error) {
    Logger::instance().flush();
    parent.send({{"error", message_of(error)}});
  } catch (...) {
    Logger::instance().flush();
    parent.send({{"error", kNoStdException}});
  }
  return 1;
}

}  // namespace takt::tools
