// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/type_description_service.hpp"

#include <optional>
#include <string>

#include <fmt/format.h>

#include "takt/messages/message_types.hpp"
#include "takt/messages/type_description.hpp"

namespace takt {
namespace {

using type_description_interfaces::srv::GetTypeDescription;

/// Looks among the types of endpoints for one with this name and hash.
class Search {
 public:
  Search(const std::string& name, const std::string& hash) : name_(name), hash_(hash) {}

  void look_at(const Endpoint& end) {
    if (found_) return;
    const ServiceIdentity& service = end.identity;
    if (service.id.empty()) {
      const MessageType* type =
          end.type->is_serialized ? message_types().find(end.type->name) : end.type;
      if (type != nullptr) message(*type);
    } else {
      message(*service.request);
      message(*service.response);
      if (service.request->name == name_ + "_Request") {
        offer(describe_service(*service.request, *service.response));
      }
    }
    if (goal_ != nullptr && result_ != nullptr && feedback_ != nullptr) {
      offer(describe_action(*goal_, *result_, *feedback_));
    }
  }

  std::optional<TypeDescription> found() && { return std::move(found_); }

 private:
  void message(const MessageType& type) {
    if (type.name == name_) offer(describe(type));
    // An action's types are fields of the messages that ROS 2 derives from the action.
    take_field(type, "_SendGoal_Request", "goal", goal_);
    take_field(type, "_GetResult_Response", "result", result_);
    take_field(type, "_FeedbackMessage", "feedback", feedback_);
  }
  void take_field(const MessageType& type, const char* ending, const char* field,
                  const MessageType*& place) const {
    if (type.name != name_ + ending) return;
    for (const MessageField& known : type.fields) {
      if (known.name == field) place = known.shape.type;
    }
  }
  void offer(std::optional<TypeDescription> description) {
    if (description && type_hash(*description) == hash_) found_ = std::move(description);
  }

  const std::string &name_, &hash_;
  const MessageType *goal_ = nullptr, *result_ = nullptr, *feedback_ = nullptr;
  std::optional<TypeDescription> found_;
};

/// Whether ROS 2 derives the type from a service or an action.
bool is_part(const std::string& name) {
  const auto slash = name.rfind('/');
  return (name.find("/srv/") != std::string::npos || name.find("/action/") != std::string::npos) &&
         name.find('_', slash) != std::string::npos;
}

/// The sources of the type and of all types that it refers to, in the same order. A program does
/// not contain the files that define types: so each source is "dynamic", or "implicit" if ROS 2
/// derives the type, and has no contents.
auto sources_of(const TypeDescription& description) {
  decltype(GetTypeDescription::Response::type_sources) sources;
  const auto add = [&](const auto& type) {
    const std::string& name = type.type_name.get();
    sources.emplace_back().set__type_name(name).set__encoding(is_part(name) ? "implicit"
                                                                            : "dynamic");
  };
  add(description.type_description);
  for (const auto& type : description.referenced_type_descriptions) add(type);
  return sources;
}

void answer(Participant& participant, const GetTypeDescription::Request& request,
            GetTypeDescription::Response& response) {
  response = {};
  Search search(request.type_name, request.type_hash);
  participant.visit_endpoints([&](const Endpoint& end) { search.look_at(end); });
  if (auto found = std::move(search).found()) {
    response.successful = true;
    response.type_description = std::move(*found);
    if (request.include_type_sources) response.type_sources = sources_of(response.type_description);
  } else {
    response.failure_reason =
        fmt::format("no topic, service or action here has the type '{}' with the hash '{}'",
                    request.type_name, request.type_hash);
  }
}

}  // namespace

TypeDescriptionService::TypeDescriptionService(const Node& node, Node& host)
    : service_(host.create_service<GetTypeDescription>(
          node.fully_qualified_name() + "/get_type_description",
          [participant = host.participant()](const GetTypeDescription::Request& request,
                                             GetTypeDescription::Response& response) {
            answer(*participant, request, response);
          },
          nullptr, rare_service(node.fully_qualified_name()))) {
}

}  // namespace takt
