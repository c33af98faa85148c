// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/type_description_client.hpp"

#include <chrono>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "takt/messages/entries.hpp"
#include "takt/messages/type_description_interfaces/srv/get_type_description.hpp"

namespace takt {
namespace {

using type_description_interfaces::srv::GetTypeDescription;
using namespace std::chrono_literals;

constexpr Nanoseconds kLookPeriod = 20ms;
constexpr Nanoseconds kPatience = 2s;  // for the answer of a node, and to discover its service

}  // namespace

struct TypeDescriptionClient::Question {
  std::string type;
  Callback callback;
  TimePoint limit;
  std::set<std::string> asked;  // services
  // State of the current request.
  std::shared_ptr<Client<GetTypeDescription>> client;  // nullptr: no request
  std::string hash;
  bool is_sent = false, is_answered = false;
  std::optional<TypeDescription> description;
};

TypeDescriptionClient::TypeDescriptionClient(Node& host)
    : host_(host), timer_(host.create_timer("ask_for_types", kLookPeriod, [this] { look(); })) {
  timer_->cancel();
}

TypeDescriptionClient::~TypeDescriptionClient() = default;

void TypeDescriptionClient::ask(std::string type, Callback callback) {
  auto question = std::make_unique<Question>();
  question->type = std::move(type);
  question->callback = std::move(callback);
  question->limit = later(timer_->clock().now(), kPatience);
  if (!goes_on(*question, host_.participant()->graph())) return question->callback(nullptr);
  questions_.push_back(std::move(question));
  if (timer_->is_canceled()) timer_->reset();
}

void TypeDescriptionClient::look() {
  const Graph graph = host_.participant()->graph();
  std::vector<std::unique_ptr<Question>> ended;
  for (auto& question : questions_) {
    if (!goes_on(*question, graph)) ended.push_back(std::move(question));
  }
  std::erase(questions_, nullptr);
  if (questions_.empty()) timer_->cancel();
  for (const auto& question : ended) {  // callbacks may ask for other types
    question->callback(question->description ? &*question->description : nullptr);
  }
}

// False: the question has an answer, or will get none.
bool TypeDescriptionClient::goes_on(Question& question, const Graph& graph) {
  const bool is_late = timer_->clock().now() >= question.limit;
  if (question.client != nullptr) {
    if (question.is_answered && question.description &&
        type_hash(*question.description) == question.hash) {
      return false;
    }
    if (!question.is_sent && question.client->service_is_ready()) send(question);
    if (!question.is_answered && !is_late) return true;
    question.client.reset();
    question.description.reset();
  }
  return ask_next(question, graph) ||
         (!is_late && question.asked.empty() && !question.hash.empty());
}

// Asks the next service, if there is one. A node may announce a type hash before its service is
// discovered: see goes_on().
bool TypeDescriptionClient::ask_next(Question& question, const Graph& graph) {
  // Limit: nodes that are asked for the description of a type, one after the other. At it: it is
  // not described. Seen: the caller gets none.
  constexpr std::size_t kMostNodes = 20;
  if (question.asked.size() == kMostNodes) return false;
  std::unordered_set<std::string_view> services;
  for (const GraphEndpoint& service : graph.services) services.insert(service.name);
  for (const auto* list : {&graph.publishers, &graph.subscriptions}) {
    for (const GraphEndpoint& end : *list) {
      if (end.type != question.type || end.type_hash.empty()) continue;
      question.hash = end.type_hash;
      const std::string service = end.node + "/get_type_description";
      if (!services.contains(service) || !is_topic_name(service) ||
          !question.asked.insert(service).second)
        continue;
      question.client = host_.create_client<GetTypeDescription>(service);
      question.is_sent = question.is_answered = false;
      question.limit = later(timer_->clock().now(), kPatience);
      return true;
    }
  }
  return false;
}

void TypeDescriptionClient::send(Question& question) {
  question.is_sent = true;
  question.client->async_send_request(
      GetTypeDescription::Request()
          .set__type_name(question.type)
          .set__type_hash(question.hash)
          .set__include_type_sources(false),
      [&question](const GetTypeDescription::Response* response) {
        question.is_answered = true;
        if (response != nullptr && response->successful && why_too_long(*response).empty()) {
          question.description = response->type_description;
        }
      });
}

}  // namespace takt
