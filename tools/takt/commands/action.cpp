// takt action: lists actions, and sends goals to them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <memory>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/dynamic_client.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "graph/type_finder.hpp"
#include "prompt/values.hpp"
#include "run/end_signals.hpp"
#include "run/result_json.hpp"

namespace takt::tools::action_command {
namespace {

using json = nlohmann::ordered_json;

struct Options : ObserverOptions {
  std::string action, type, goal = "{}";
  Nanoseconds timeout = std::chrono::seconds(5);
  bool shows_types = false, feedback = false;

  bool prints() const { return json_path != "-"; }
};

// ---- list, info ----

struct Action {
  std::set<std::string> types;
  std::vector<std::string> servers, clients;  // their nodes
};

/// By name. Servers publish the feedback, clients subscribe to it.
std::map<std::string, Action> actions_of(const Graph& graph) {
  constexpr std::string_view kTopic = kFeedback, kType = "_FeedbackMessage";
  std::map<std::string, Action> actions;
  const auto add = [&](const std::vector<GraphEndpoint>& endpoints, auto nodes) {
    for (const GraphEndpoint& endpoint : endpoints) {
      if (!endpoint.name.ends_with(kTopic) || !endpoint.type.ends_with(kType)) continue;
      Action& action = actions[endpoint.name.substr(0, endpoint.name.size() - kTopic.size())];
      action.types.insert(endpoint.type.substr(0, endpoint.type.size() - kType.size()));
      (action.*nodes).push_back(endpoint.node.empty() ? "?" : endpoint.node);
    }
  };
  add(graph.publishers, &Action::servers);
  add(graph.subscriptions, &Action::clients);
  return actions;
}

[[noreturn]] void no_action(const std::string& name, const std::map<std::string, Action>& actions) {
  std::vector<std::string> names;
  for (const auto& [known, action] : actions) names.push_back(known);
  throw Error(fmt::format("there is no action '{}'", name),
              names.empty()
                  ? "no action was discovered on this DDS domain (--domain, ROS_DOMAIN_ID)"
                  : suggest(name, names));
}

json row(const std::string& name, const Action& action) {
  return {{"action", name},
          {"types", action.types},
          {"servers", action.servers},
          {"clients", action.clients}};
}

void list(const Options& options) {
  const auto is_shown = [&](const auto& action) { return options.all || !is_hidden(action.first); };
  const Graph graph = Observer(options).whole_graph([&](const Graph& seen) {
    const auto actions = actions_of(seen);
    return std::any_of(actions.begin(), actions.end(), is_shown);
  });
  json rows = json::array();
  for (const auto& [name, action] : actions_of(graph)) {
    if (is_hidden(name) && !options.all) continue;
    rows.push_back(row(name, action));
    if (!options.prints()) continue;
    rt::print("{}", name);
    if (options.shows_types) rt::print(" [{}]", fmt::join(action.types, ", "));
    rt::print("\n");
  }
  if (rows.empty()) rt::to_stderr("no action on DDS domain {}\n", options.domain.number());
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

/// Throws Error if there is none.
Action find(const Options& options) {
  const std::string name = absolute(options.action);
  const auto actions = actions_of(Observer(options).whole_graph(
      [&](const Graph& seen) { return actions_of(seen).contains(name); }));
  const auto found = actions.find(name);
  if (found == actions.end()) no_action(name, actions);
  return found->second;
}

void type(const Options& options) {
  for (const std::string& each : find(options).types) rt::print("{}\n", each);
}

void info(const Options& options) {
  const std::string name = absolute(options.action);
  const Action action = find(options);
  const std::string types =
      options.shows_types ? fmt::format(" [{}]", fmt::join(action.types, ", ")) : "";
  if (options.prints()) {
    rt::print("Action: {}\n", name);
    for (const auto& [title, nodes] :
         {std::pair("clients", &action.clients), {"servers", &action.servers}}) {
      rt::print("Action {}: {}\n", title, nodes->size());
      for (const std::string& node : *nodes) rt::print("    {}{}\n", node, types);
    }
  }
  if (!options.json_path.empty()) write_json(row(name, action), options.json_path);
}

// ---- send_goal ----

MessageField field(const char* name, const MessageType& type) {
  return {.name = name,
          .type = type.name,
          .fixed_size = type.fixed_size,
          .shape = {.id = FieldShape::nested, .type = &type}};
}

/// The messages that ROS 2 makes of an action's three.
struct ActionTypes {
  ActionTypes(const std::string& name, const Observer& observer)
      : finder(observer),
        goal(finder.require(name + "_Goal")),
        send_request(make(name + "_SendGoal_Request", {id, field("goal", goal)})),
        send_response(make(name + "_SendGoal_Response",
                           {detail::describe_field<bool>("accepted", 0),
                            detail::describe_field<builtin_interfaces::msg::Time>("stamp", 0)})),
        result_request(make(name + "_GetResult_Request", {id})),
        result_response(make(name + "_GetResult_Response",
                             {detail::describe_field<std::int8_t>("status", 0),
                              field("result", finder.require(name + "_Result"))})),
        feedback(make(name + "_FeedbackMessage",
                      {id, field("feedback", finder.require(name + "_Feedback"))})) {}
  ActionTypes(const ActionTypes&) = delete;

  static MessageType make(std::string name, std::vector<MessageField> fields) {
    return detail::finish_message_type({.name = std::move(name), .fields = std::move(fields)});
  }

  TypeFinder finder;
  const MessageField id = detail::describe_field<GoalId>("goal_id", 0);
  const MessageType& goal;
  const MessageType send_request, send_response, result_request, result_response, feedback;
};

std::string indented(const json& fields, std::size_t indent) {
  std::istringstream lines(to_yaml(fields));
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    text += fmt::format("{:{}}{}\n", "", indent, line);
  }
  return text;
}

std::string upper(std::string_view text) {
  std::string result;
  for (const char c : text) result += static_cast<char>(std::toupper(c));
  return result;
}

/// A goal on its path from the request to the result. The first Ctrl-C cancels it; the second ends
/// the program.
class GoalRun {
 public:
  explicit GoalRun(const Options& options)
      : options_(options),
        name_(absolute(options.action)),
        observer_(options),
        types_(options.type, observer_),
        feedback_(options.feedback ? subscribe() : nullptr),
        send_(observer_, name_ + kSendGoal, types_.send_request, types_.send_response,
              [this](const json& fields) { accepted_ = fields["accepted"].get<bool>(); }),
        get_result_(observer_, name_ + kGetResult, types_.result_request, types_.result_response,
                    [this](const json& fields) { result_ = fields; }),
        cancel_(observer_.node().create_client<CancelGoal>(name_ + kCancelGoal)) {
    if (feedback_ != nullptr) wait_set_.add(feedback_);
    wait_set_.add(send_.responses());
    wait_set_.add(get_result_.responses());
    wait_set_.add(cancel_);
  }

  void run() {
    const ByteBuffer request = encoded_goal();
    wait_for_server();
    print("Sending goal:\n{}\n",
          indented(read_message(types_.goal, request.bytes(), {.skipped = kGoalOffset}), 5));
    send_.send(request.bytes());
    if (!serve([this] { return accepted_.has_value(); }, options_.timeout,
               [this] { return is_interrupted(); })) {
      if (signal_ != 0) throw Interrupted(signal_, " before the goal was accepted");
      no_response("the goal");
    }
    if (!*accepted_) throw Error(fmt::format("action '{}' rejected the goal", name_));
    print("Goal accepted with ID: {}\n\n", to_string(id_));
    const std::string of_goal =
        fmt::format("{{goal_id: {{uuid: [{}]}}}}", fmt::join(id_.uuid, ","));
    get_result_.send(write_message(types_.result_request, of_goal, get_result_.header()).bytes());
    if (serve([this] { return result_.has_value(); }, Nanoseconds::zero(),
              [this] { return is_interrupted() || !get_result_.service_is_ready(); })) {
      finish();
    } else if (signal_ != 0) {
      cancel();
    } else {
      throw Error(fmt::format("the server of action '{}' has gone", name_),
                  "its log may say why; the result of the goal is unknown");
    }
  }

 private:
  static constexpr std::size_t kGoalOffset = 32;  // behind the header and the goal's id

  template <class... Args>
  void print(fmt::format_string<Args...> format, Args&&... args) const {
    if (!options_.prints()) return;
    rt::print(format, std::forward<Args>(args)...);
    rt::flush_output();
  }

  ByteBuffer encoded_goal() const {
    std::vector<std::byte> header(send_.header().begin(), send_.header().end());
    for (const std::uint8_t byte : id_.uuid) header.push_back(std::byte(byte));
    return write_message(types_.goal, options_.goal, header);
  }

  bool server_is_ready() const {
    return send_.service_is_ready() && get_result_.service_is_ready() &&
           cancel_->service_is_ready() &&
           (feedback_ == nullptr || feedback_->outside_publisher_count() != 0);
  }

  void wait_for_server() {
    print("Waiting for an action server to become available...\n");
    if (serve([this] { return server_is_ready(); }, options_.timeout,
              [this] { return is_interrupted(); }))
      return;
    if (signal_ != 0) throw Interrupted(signal_, " before a server did");
    const auto actions = actions_of(observer_.participant()->graph());
    const auto found = actions.find(name_);
    if (found == actions.end()) no_action(name_, actions);
    if (const auto& types = found->second.types; !types.contains(options_.type)) {
      throw Error(fmt::format("action '{}' has the type {}", name_, fmt::join(types, ", ")),
                  fmt::format("the goal is of {}", options_.type));
    }
    throw Error(fmt::format("action '{}' has no server", name_),
                "check that the server runs on the same DDS domain (--domain, ROS_DOMAIN_ID)");
  }

  /// Executes what comes until `is_done`. Returns false if the time is over (0: no limit), or if
  /// `gives_up`.
  template <class Done, class GivesUp>
  bool serve(Done is_done, Nanoseconds limit, GivesUp gives_up) {
    const TimePoint end = later(Clock::steady().now(), limit);
    while (!is_done()) {
      for (const auto& entity : wait_set_.wait(std::chrono::milliseconds(20))) {
        for (Slot slot; entity->take(slot); slot = {}) entity->execute(slot);
      }
      if (is_done()) break;
      if (gives_up() || (limit != Nanoseconds::zero() && Clock::steady().now() > end)) return false;
    }
    return true;
  }
  bool is_interrupted() {
    if (signal_ == 0) signal_ = signals_.take();
    return signal_ != 0;
  }

  std::shared_ptr<SubscriptionBase> subscribe() {
    return observer_.node().create_generic_subscription(
        name_ + kFeedback, types_.feedback.name, QoS(10),
        [this](std::span<const std::byte> bytes, const MessageInfo&) { show_feedback(bytes); });
  }
  void show_feedback(std::span<const std::byte> bytes) {
    json fields = read_message(types_.feedback, bytes);
    if (fields["goal_id"]["uuid"] != json(id_.uuid)) return;
    print("Feedback:\n{}\n", indented(fields["feedback"], 4));
    if (!options_.json_path.empty()) feedbacks_.push_back(std::move(fields["feedback"]));
  }

  void finish() {
    const auto state = static_cast<GoalState>((*result_)["status"].get<std::int8_t>());
    const std::string status = upper(to_string(state));
    print("Result:\n{}\nGoal finished with status: {}\n", indented((*result_)["result"], 4),
          status);
    if (!options_.json_path.empty()) {
      json document = {{"action", name_},
                       {"goal_id", to_string(id_)},
                       {"status", status},
                       {"result", (*result_)["result"]}};
      if (options_.feedback) document["feedback"] = feedbacks_;
      write_json(document, options_.json_path);
    }
    if (state != GoalState::succeeded) throw CLI::RuntimeError(kFailed);
  }

  void cancel() {
    print("Canceling goal...\n");
    CancelGoal::Request request;
    request.goal_info.goal_id = id_;
    cancel_->async_send_request(request, [this](const CancelGoal::Response* answer) {
      canceled_ = answer != nullptr ? answer->goals_canceling.size() : 0;
    });
    bool is_hurried = false;
    const auto hurries = [&] { return is_hurried = signals_.take() != 0; };
    if (!serve([this] { return canceled_.has_value(); }, options_.timeout, hurries)) {
      if (is_hurried) throw Interrupted(signal_, " before the goal was canceled");
      no_response("the cancellation");
    }
    if (*canceled_ == 0) {
      throw Error(fmt::format("action '{}' did not cancel the goal", name_),
                  "its server refused, or the goal has just ended");
    }
    print("Goal canceled.\n");
    throw Interrupted(signal_, " before the result");
  }

  [[noreturn]] void no_response(const char* request) const {
    throw Error(fmt::format("action '{}': no response to {} within {}", name_, request,
                            to_string(options_.timeout)),
                "check that its server is not busy or stopped");
  }

  const EndSignals signals_;  // before any thread
  const Options& options_;
  const std::string name_;
  Observer observer_;
  const ActionTypes types_;
  const GoalId id_ = new_goal_id();
  int signal_ = 0;
  std::optional<bool> accepted_;
  std::optional<json> result_;
  json feedbacks_ = json::array();
  std::optional<std::size_t> canceled_;               // how many goals the server cancels
  const std::shared_ptr<SubscriptionBase> feedback_;  // the first that the server discovers
  DynamicClient send_, get_result_;
  const std::shared_ptr<Client<CancelGoal>> cancel_;
  WaitSet wait_set_;
};

void send_goal(const Options& options) {
  GoalRun(options).run();
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&)) {
    CLI::App* sub = command->add_subcommand(name, what);
    if (function != &list) sub->add_option("ACTION", options->action, "Its name")->required();
    add_observer_options(*sub, *options);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  CLI::App* list_command = add("list", "Lists all actions", list);
  list_command->add_flag("-a,--all", options->all,
                         "Include hidden actions, whose names begin with '_'");
  add("type", "Prints the type of an action", type);
  CLI::App* info_command = add("info", "Shows the clients and servers of an action", info);
  for (CLI::App* sub : {list_command, info_command}) {
    sub->add_flag("-t,--show-types", options->shows_types, "Show the type, too");
  }
  CLI::App* send_command =
      add("send_goal", "Sends a goal, and prints the result; Ctrl-C cancels the goal", send_goal);
  send_command
      ->add_option("TYPE", options->type,
                   "The type, for example example_interfaces/action/Fibonacci")
      ->required();
  add_library_option(*send_command, options->libraries);
  send_command->add_option("GOAL", options->goal, "The goal as YAML; missing fields are zero");
  send_command->add_flag("-f,--feedback", options->feedback, "Print the feedback");
  add_time_option(*send_command, "--timeout", options->timeout,
                  "Time limit of everything but the result (default: 5s)");
  command->footer(
      "Example:\n"
      "  takt action list -t\n"
      "  takt action type /fibonacci\n"
      "  takt action info /fibonacci\n"
      "  takt action send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 5}' -f\n");
}
const Command registered("action", "Lists actions, and sends goals to them, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::action_command
