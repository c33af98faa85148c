// Calls a service of another process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_
#define TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/entries.hpp"

#include "exit_status.hpp"
#include "run/live_line.hpp"

namespace takt::tools {

/// The full name of a node's service `/name`; the node's leading slash may be missing.
inline std::string service_of(const std::string& node, const char* name) {
  return (node.starts_with('/') ? "" : "/") + node + name;
}

/// The names N of the services "/N" + `ending` on the graph, of this type if it is not empty, and
/// how many processes have each. A stranger may announce any number: of `most` names, each process
/// gives one in turn.
std::map<std::string, std::size_t> owners_in(const Graph& graph, std::string_view ending,
                                             std::string_view type, std::size_t most);
// Limit: services of one kind, as all containers have one, that a command asks at the same time. At
// it: of each process as many as of every other are asked. Seen: a note.
inline constexpr std::size_t kMostAsked = 200;

/// How long a listing waits for the answers of all.
inline constexpr std::chrono::seconds kListLimit(5);

/// A service client on the domain.
class Caller {
 public:
  explicit Caller(int domain) {
    DdsOptions options{.domain = domain};
    options.shared_memory = SharedMemory::off;  // joining it costs more than a few requests
    participant_ = Participant::create(options);
    begin_work();
    node_ = std::make_shared<Node>(fmt::format("_takt_{}", getpid()),
                                   NodeOptions{.participant = participant_});
    executor_->add_node(node_);
  }

  /// The names N of all services "/N" + `ending` that are discovered half a second after the start;
  /// if there is none, within 3 s more.
  std::vector<std::string> find(const std::string& ending);

  /// Throws Error if several processes have a server of the service: each would do what is asked.
  void check_is_one(const std::string& service, const std::string& whose);
  static void check_is_one(std::size_t servers, const std::string& whose);
  /// How many processes have a server of each service, half a second after the start.
  std::map<std::string, std::size_t> servers();

  /// What is discovered, with the names of nodes, which come a little later.
  Graph graph();

  /// Whether a service of this name is ready, or becomes so within the limit.
  template <class S>
  bool finds(const std::string& service, Nanoseconds limit) {
    const auto client = node_->create_client<S>(service);
    return comes_true([&] { return client->service_is_ready(); }, limit);
  }

  /// Those that answered in time, with their answers, and the others.
  template <class S>
  struct Answers {
    std::vector<std::pair<std::string, typename S::Response>> in_time;
    std::vector<std::string> silent;
  };
  /// Asks the services "/N" + `ending` of all `owners` N at the same time, so that one that does
  /// not answer delays the others only until the limit.
  template <class S>
  Answers<S> ask_all(const std::vector<std::string>& owners, const char* ending,
                     const typename S::Request& request, Nanoseconds limit);

  /// A request that was sent.
  template <class S>
  struct Call {
    std::shared_ptr<Client<S>> client;
    Future<typename Client<S>::Answer> answer;
  };

  /// Throws Error if the service is not found; `whose` names the server in the error.
  template <class S>
  Call<S> send(const std::string& service, const typename S::Request& request,
               const std::string& whose) {
    const auto client = node_->create_client<S>(service);
    const auto is_ready = [&] { return client->service_is_ready(); };
    if (!comes_true(is_ready, std::chrono::seconds(3))) nobody(service, whose);
    return {client, client->async_send_request(request)};
  }
  /// Returns an empty answer if there is none in time, or the server goes.
  template <class S>
  typename Client<S>::Answer receive(const Call<S>& call, Nanoseconds limit) {
    const LiveLine line("waiting for an answer");
    const TimePoint end = later(Clock::steady().now(), limit);
    while (!call.answer.ready() && Clock::steady().now() < end) {
      executor_->spin_until_future_complete(call.answer, std::chrono::milliseconds(100));
      if (!call.client->service_is_ready()) break;
    }
    return call.answer.ready() ? call.answer.get() : typename Client<S>::Answer{};
  }
  /// Throws Error if there is no response, or no server any more.
  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request,
                            const std::string& whose,
                            Nanoseconds limit = std::chrono::seconds(30)) {
    const auto sent = send<S>(service, request, whose);
    const auto answer = receive(sent, limit);
    if (answer) {
      const std::string why = why_too_long(*answer);
      if (!why.empty()) throw Error(fmt::format("the answer of {} is not read: {}", whose, why));
      return *answer;
    }
    if (!sent.client->service_is_ready()) {
      throw Error(fmt::format("{} has gone without a response", whose), "its log may say why");
    }
    no_response(whose, limit);
  }
  [[noreturn]] static void no_response(const std::string& whose, Nanoseconds limit);
  /// Throws Error: the service was not found; it suggests others.
  [[noreturn]] void nobody(const std::string& service, const std::string& whose) const;
  /// As no_response, for a listing: after the others have been shown. Returns if nobody was silent.
  static void name_silent(const char* what, const std::vector<std::string>& silent,
                          Nanoseconds limit);

 private:
  static bool comes_true(const std::function<bool()>& condition, Nanoseconds limit);
  std::vector<std::string> owners(const std::string& ending) const;

  const std::chrono::steady_clock::time_point discovered_ =
      later(std::chrono::steady_clock::now(), std::chrono::milliseconds(500));
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Node> node_;
  std::unique_ptr<Executor> executor_ = executors().make("events", {.name = "call"});
};

template <class S>
Caller::Answers<S> Caller::ask_all(const std::vector<std::string>& owners, const char* ending,
                                   const typename S::Request& request, Nanoseconds limit) {
  struct Question {
    std::shared_ptr<Client<S>> client;
    std::optional<Future<typename Client<S>::Answer>> answer;

    bool is_answered() const { return answer && answer->ready(); }
  };
  std::vector<Question> questions;
  for (const std::string& owner : owners) {
    questions.push_back({node_->create_client<S>(service_of(owner, ending)), {}});
  }
  const LiveLine line("waiting for answers");
  const TimePoint end = later(Clock::steady().now(), limit);
  while (!std::all_of(questions.begin(), questions.end(), std::mem_fn(&Question::is_answered)) &&
         Clock::steady().now() < end) {
    for (Question& question : questions) {
      if (question.answer || !question.client->service_is_ready()) continue;
      question.answer = question.client->async_send_request(request);
    }
    executor_->spin_once(std::chrono::milliseconds(5));
  }
  Answers<S> answers;
  for (std::size_t i = 0; i < owners.size(); ++i) {
    const auto answer =
        questions[i].is_answered() ? questions[i].answer->get() : typename Client<S>::Answer{};
    const std::string why = answer ? why_too_long(*answer) : "";
    if (!why.empty()) rt::to_stderr("note: the answer of '{}' is not read: {}\n", owners[i], why);
    if (answer && why.empty()) {
      answers.in_time.emplace_back(owners[i], *answer);
    } else {
      answers.silent.push_back(owners[i]);
    }
  }
  return answers;
}

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SERVICE_CALL_HPP_
