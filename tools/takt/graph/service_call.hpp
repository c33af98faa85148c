// One request to a service of another process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_
#define TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"

namespace takt::tools {

/// The full name of a node's service `/name`, however its user has written the node.
inline std::string service_of(const std::string& node, const char* name) {
  return (node.starts_with('/') ? "" : "/") + node + name;
}

/// A process on the domain that looks on, and asks.
class Caller {
 public:
  explicit Caller(int domain) {
    DdsOptions options;
    options.domain = domain;
    options.shared_memory = SharedMemory::off;  // a few requests are not worth joining it
    participant_ = Participant::create(options);
    node_ = std::make_shared<Node>(fmt::format("_takt_{}", getpid()),
                                   NodeOptions{.participant = participant_});
    executor_->add_node(node_);
  }

  /// The names N of all services "/N" + `ending`, as far as they are heard of in half a second.
  std::vector<std::string> find(const std::string& ending) const;

  /// Throws Error when nobody answers; `whose` is what it calls the one who should.
  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request,
                            const std::string& whose,
                            Nanoseconds limit = std::chrono::seconds(30)) {
    const auto client = node_->create_client<S>(service);
    const TimePoint late = Clock::steady().now() + std::chrono::seconds(3);
    while (!client->service_is_ready()) {
      if (Clock::steady().now() > late) nobody(whose);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const auto answer = client->async_send_request(request);
    executor_->spin_until_future_complete(answer, limit);
    if (!answer.ready() || !answer.get()) {
      throw Error(fmt::format("{} has not answered within {}", whose, to_string(limit)),
                  "is it busy, or stopped?");
    }
    return *answer.get();
  }

 private:
  [[noreturn]] void nobody(const std::string& whose) const;

  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Node> node_;
  std::unique_ptr<Executor> executor_ = executors().make("events", {.name = "call"});
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_
