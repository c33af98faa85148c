// takt param: lists, shows and sets the parameters of nodes.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/printable.hpp"
#include "takt/containers/configuration/parameter_file.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"
#include "takt/ros2/parameter_services.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "graph/service_call.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/result_json.hpp"

namespace takt::tools::param_command {
namespace {

namespace msg = rcl_interfaces::msg;
namespace srv = rcl_interfaces::srv;
using json = nlohmann::ordered_json;
using msg::ParameterType;

constexpr const char* kList = "/list_parameters";

struct Options {
  DomainOption domain;
  Nanoseconds timeout = std::chrono::seconds(5);
  std::string node, name, value, file, json_path;
  std::vector<std::string> names;
  bool all = false, hide_type = false;

  bool prints() const { return json_path != "-"; }
};

void write(const json& document, const Options& options) {
  if (!options.json_path.empty()) write_json(document, options.json_path);
}

/// The parameter services of one node.
class ParameterClient {
 public:
  ParameterClient(Caller& caller, const Options& options)
      : caller_(caller), node_(absolute(options.node)), limit_(options.timeout) {}

  const std::string& node() const noexcept { return node_; }
  std::vector<std::string> names() {
    auto names = call<srv::ListParameters>(kList, {}).result.names;
    std::sort(names.begin(), names.end());
    return names;
  }
  std::vector<msg::ParameterValue> values(const std::vector<std::string>& names) {
    return for_each(names, call<srv::GetParameters>("/get_parameters",
                                                    srv::GetParameters::Request().set__names(names))
                               .values);
  }
  std::vector<msg::ParameterDescriptor> descriptors(const std::vector<std::string>& names) {
    return for_each(
        names, call<srv::DescribeParameters>("/describe_parameters",
                                             srv::DescribeParameters::Request().set__names(names))
                   .descriptors);
  }
  std::vector<msg::SetParametersResult> set(const std::vector<msg::Parameter>& parameters) {
    auto results = call<srv::SetParameters>(
                       "/set_parameters", srv::SetParameters::Request().set__parameters(parameters))
                       .results;
    if (results.size() != parameters.size()) {
      throw Error(fmt::format("node '{}' answered with {} results for {} parameters", node_,
                              results.size(), parameters.size()));
    }
    return results;
  }
  std::uint8_t type_of(const std::string& name) {
    const auto types =
        call<srv::GetParameterTypes>("/get_parameter_types",
                                     srv::GetParameterTypes::Request().set__names({name}))
            .types;
    return types.empty() ? ParameterType::PARAMETER_NOT_SET : types.front();
  }
  /// It is one now, and its type is fixed.
  bool is_always_text(const std::string& name) {
    if (type_of(name) != ParameterType::PARAMETER_STRING) return false;
    const auto found = descriptors({name});
    return !found.empty() && !found.front().dynamic_typing;
  }
  /// The notation of the value gives its type; an empty list has the type of the node's parameter.
  msg::ParameterValue read(const document::Value& value, document::Errors& errors) {
    if (document::is_empty_list(&value)) {
      const std::uint8_t type = type_of(value.name);
      if (type >= ParameterType::PARAMETER_BYTE_ARRAY) {
        return msg::ParameterValue().set__type(type);
      }
    }
    const std::optional<ParameterValue> parameter = read_parameter(value, errors);
    return parameter ? to_message(*parameter) : msg::ParameterValue();
  }

 private:
  template <class S>
  typename S::Response call(const char* service, const typename S::Request& request) {
    return caller_.call<S>(service_of(node_, service), request, fmt::format("node '{}'", node_),
                           limit_);
  }
  // A node answers with nothing at all if it has no parameter of one of the names.
  template <class Item>
  std::vector<Item> for_each(const std::vector<std::string>& names, std::vector<Item> items) {
    if (items.size() == names.size()) return items;
    const std::vector<std::string> known = this->names();
    for (const std::string& name : names) {
      if (std::binary_search(known.begin(), known.end(), name)) continue;
      throw Error(fmt::format("node '{}' has no parameter '{}'", node_, name),
                  known.empty() ? "it has none at all" : suggest(name, known));
    }
    throw Error(fmt::format("node '{}' answered with {} of {} parameters", node_, items.size(),
                            names.size()),
                "a parameter that is declared without a value has none");
  }

  Caller& caller_;
  const std::string node_;
  const Nanoseconds limit_;
};

json to_json(const msg::ParameterValue& value) {
  switch (value.type) {
    case ParameterType::PARAMETER_BOOL:
      return value.bool_value;
    case ParameterType::PARAMETER_INTEGER:
      return value.integer_value;
    case ParameterType::PARAMETER_DOUBLE:
      return value.double_value;
    case ParameterType::PARAMETER_STRING:
      return value.string_value;
    case ParameterType::PARAMETER_BYTE_ARRAY:
      return value.byte_array_value;
    case ParameterType::PARAMETER_BOOL_ARRAY:
      return value.bool_array_value;
    case ParameterType::PARAMETER_INTEGER_ARRAY:
      return value.integer_array_value;
    case ParameterType::PARAMETER_DOUBLE_ARRAY:
      return value.double_array_value;
    case ParameterType::PARAMETER_STRING_ARRAY:
      return value.string_array_value;
    default:
      return nullptr;
  }
}

struct TypeWords {
  const char* name;
  const char* value;  // precedes the value
};
TypeWords words_of(std::uint8_t type) {
  constexpr std::array<TypeWords, 10> kWords = {{{"not set", "Parameter not set."},
                                                 {"boolean", "Boolean value is:"},
                                                 {"integer", "Integer value is:"},
                                                 {"double", "Double value is:"},
                                                 {"string", "String value is:"},
                                                 {"byte array", "Byte values are:"},
                                                 {"boolean array", "Boolean values are:"},
                                                 {"integer array", "Integer values are:"},
                                                 {"double array", "Double values are:"},
                                                 {"string array", "String values are:"}}};
  return type < kWords.size() ? kWords.at(type) : TypeWords{"unknown", "Value of unknown type:"};
}

// As Python prints it, and so `ros2 param`: True, 1.0, ['a', 'b'].
std::string to_text(const json& value, bool is_item = false) {
  if (value.is_boolean()) return value.get<bool>() ? "True" : "False";
  if (value.is_null()) return "None";
  if (value.is_number_float()) {
    const std::string text = fmt::format("{}", value.get<double>());
    const bool is_whole = text.find_first_not_of("-0123456789") == std::string::npos;
    return is_whole ? text + ".0" : text;
  }
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (!is_item) return text;
    return text.find('\'') == std::string::npos ? fmt::format("'{}'", text)
                                                : fmt::format("\"{}\"", text);
  }
  if (!value.is_array()) return rt::json_text(value);
  std::vector<std::string> items;
  for (const json& item : value) items.push_back(to_text(item, true));
  return fmt::format("[{}]", fmt::join(items, ", "));
}

// ---- list ----

void list_of_node(const Options& options) {
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  const std::vector<std::string> names = client.names();
  if (options.prints()) {
    for (const std::string& name : names) rt::print("  {}\n", name);
  }
  write(json::array({{{"node", client.node()}, {"parameters", names}}}), options);
}

void list(const Options& options) {
  if (!options.node.empty()) return list_of_node(options);
  Caller caller(options.domain.number());
  std::vector<std::string> nodes;
  for (const std::string& owner : caller.find(kList)) {
    if (!is_hidden(absolute(owner)) || options.all) nodes.push_back(absolute(owner));
  }
  auto answers = caller.ask_all<srv::ListParameters>(nodes, kList, {}, options.timeout);
  json rows = json::array();
  for (auto& [node, answer] : answers.in_time) {
    std::vector<std::string>& names = answer.result.names;
    std::sort(names.begin(), names.end());
    if (options.prints() && !names.empty()) {
      rt::print("{}:\n  {}\n", node, fmt::join(names, "\n  "));
    }
    rows.push_back({{"node", node}, {"parameters", names}});
  }
  if (nodes.empty()) {
    rt::to_stderr("no node with parameters on DDS domain {}\n", options.domain.number());
  }
  write(rows, options);
  Caller::name_silent("node", answers.silent, options.timeout);
}

// ---- get, describe ----

void get(const Options& options) {
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  const msg::ParameterValue value = client.values({options.name}).front();
  const auto [type, words] = words_of(value.type);
  const json content = to_json(value);
  if (options.prints()) {
    if (content.is_null() || !options.hide_type) rt::print("{}", words);
    if (!content.is_null()) {
      rt::print("{}{}", options.hide_type ? "" : " ", to_text(content));
    }
    rt::print("\n");
  }
  write({{"node", client.node()}, {"name", options.name}, {"type", type}, {"value", content}},
        options);
}

template <class Ranges>
json range_of(const Ranges& ranges) {
  if (ranges.empty()) return nullptr;
  const auto& range = ranges[0];
  return {{"from_value", range.from_value}, {"to_value", range.to_value}, {"step", range.step}};
}

void print_description(const json& row) {
  rt::print("Parameter name: {}\n  Type: {}\n", to_text(row["name"]), to_text(row["type"]));
  const auto print_text = [&](const char* what, const char* key) {
    if (row[key] != "") rt::print("{}: {}\n", what, to_text(row[key]));
  };
  print_text("  Description", "description");
  rt::print("  Constraints:\n");
  if (row["read_only"] == true) rt::print("    Read only: true\n");
  if (const json& range = row["range"]; !range.is_null()) {
    rt::print("    Min value: {}\n    Max value: {}\n", to_text(range["from_value"]),
              to_text(range["to_value"]));
    if (range["step"] != 0) rt::print("    Step: {}\n", to_text(range["step"]));
  }
  print_text("    Additional constraints", "additional_constraints");
}

void describe(const Options& options) {
  Caller caller(options.domain.number());
  json rows = json::array();
  for (const msg::ParameterDescriptor& descriptor :
       ParameterClient(caller, options).descriptors(options.names)) {
    rows.push_back({{"name", descriptor.name},
                    {"type", words_of(descriptor.type).name},
                    {"description", descriptor.description},
                    {"read_only", descriptor.read_only},
                    {"dynamic_typing", descriptor.dynamic_typing},
                    {"range", descriptor.floating_point_range.empty()
                                  ? range_of(descriptor.integer_range)
                                  : range_of(descriptor.floating_point_range)},
                    {"additional_constraints", descriptor.additional_constraints}});
    if (options.prints()) print_description(rows.back());
  }
  write(rows, options);
}

// ---- set, delete, dump, load ----

/// As ROS 2 says it: "Set parameter successful".
void report(const msg::SetParametersResult& result, const Options& options, const char* done,
            const char* failed) {
  const std::string reason = result.reason.empty() ? "" : ": " + printable(result.reason);
  write({{"successful", result.successful}, {"reason", result.reason}}, options);
  if (!result.successful) throw Error(failed + reason);
  if (options.prints()) rt::print("{}{}\n", done, reason);
}

/// What a text parameter gets: `off`, ` ` and `a: b` as they are; quotes and `!!str` are YAML's.
bool is_text_as_it_is(const std::string& value) {
  return !value.starts_with('"') && !value.starts_with('\'') && !value.starts_with("!!str");
}

void set(const Options& options) {
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  document::Errors errors("the value");
  document::Value value{.name = options.name, .content = options.value};
  const bool is_text = options.value.empty() ||
                       (is_text_as_it_is(options.value) && client.is_always_text(options.name));
  if (!is_text) {
    value = document::parse_yaml(options.value, errors, document::Rules::parameters);
    errors.throw_if_any();
    value.name = options.name;
  }
  const auto parameter =
      msg::Parameter().set__name(options.name).set__value(client.read(value, errors));
  errors.throw_if_any();
  report(client.set({parameter}).front(), options, "Set parameter successful",
         "setting parameter failed");
}

// By a value without a type.
void delete_one(const Options& options) {
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  report(client.set({msg::Parameter().set__name(options.name)}).front(), options,
         "Deleted parameter successfully", "deleting parameter failed");
}

/// Adds the parameter "a.b" as {"a": {"b": value}}.
void add_parameter(nlohmann::ordered_json& parameters, const std::string& name,
                   nlohmann::ordered_json value) {
  const std::size_t dot = name.find('.');
  if (dot != std::string::npos) {
    const auto inner = parameters.emplace(name.substr(0, dot), nlohmann::ordered_json::object());
    // "a" may have a value of its own.
    if (inner.first->is_object()) {
      return add_parameter(*inner.first, name.substr(dot + 1), std::move(value));
    }
  }
  parameters[name] = std::move(value);
}

void dump(const Options& options) {
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  const std::vector<std::string> names = client.names();
  const std::vector<msg::ParameterValue> values = client.values(names);
  json parameters = json::object();
  for (std::size_t i = 0; i < names.size(); ++i) {
    // The file has no notation for a parameter without a value.
    if (json value = to_json(values[i]); !value.is_null()) {
      add_parameter(parameters, names[i], std::move(value));
    }
  }
  const json document = {{client.node(), {{document::kRosParameters, std::move(parameters)}}}};
  if (options.prints()) rt::print("{}", to_yaml(document));
  write(document, options);
}

void load(const Options& options) {
  document::Errors errors(options.file);
  const std::vector<document::Value> values =
      document::parameters_of(document::read(options.file, errors, document::Rules::parameters),
                              absolute(options.node), errors);
  errors.throw_if_any();
  Caller caller(options.domain.number());
  ParameterClient client(caller, options);
  std::vector<msg::Parameter> parameters;
  for (const document::Value& value : values) {
    parameters.push_back(
        msg::Parameter().set__name(value.name).set__value(client.read(value, errors)));
  }
  errors.throw_if_any();
  const std::vector<msg::SetParametersResult> results = client.set(parameters);
  json rows = json::array();
  bool is_failed = false;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto& [name, result] = std::pair(parameters[i].name, results[i]);
    const std::string reason = result.reason.empty() ? "" : ": " + printable(result.reason);
    rows.push_back({{"name", name}, {"successful", result.successful}, {"reason", result.reason}});
    is_failed = is_failed || !result.successful;
    if (!result.successful) rt::to_stderr("Set parameter {} failed{}\n", name, reason);
    if (result.successful && options.prints()) {
      rt::print("Set parameter {} successful{}\n", name, reason);
    }
  }
  write(rows, options);
  if (is_failed) throw CLI::RuntimeError(kFailed);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&)) {
    CLI::App* sub = command->add_subcommand(name, what);
    CLI::Option* node = sub->add_option("NODE", options->node, "Its name, with its namespace");
    if (function != &list) node->required();
    options->domain.add_to(*sub);
    add_time_option(*sub, "--timeout", options->timeout,
                    "Time limit of each response (default: 5s)");
    add_output(*sub, "--json", options->json_path, "Also write the result as JSON; - for stdout");
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  add("list", "Lists the parameters of one node, or of all", list)
      ->add_flag("-a,--all", options->all, "Include hidden nodes, whose names begin with '_'");
  CLI::App* get_command = add("get", "Prints the value of a parameter", get);
  get_command->add_option("NAME", options->name, "The parameter's name")->required();
  get_command->add_flag("--hide-type", options->hide_type, "Print only the value");
  CLI::App* set_command = add("set", "Sets a parameter", set);
  set_command->add_option("NAME", options->name, "The parameter's name")->required();
  set_command
      ->add_option("VALUE", options->value,
                   "The value as in a parameter file, whose notation gives its type: 1, 1.0, true, "
                   "[1, 2], word; for a text it is taken as it is")
      ->required();
  add("delete", "Deletes a parameter, if its node permits that", delete_one)
      ->add_option("NAME", options->name, "The parameter's name")
      ->required();
  add("describe", "Shows types, descriptions and constraints of parameters", describe)
      ->add_option("NAME", options->names, "The parameters' names")
      ->required();
  add("dump", "Prints all parameters of a node as a ROS 2 parameter file", dump);
  add("load", "Sets the parameters of a node from a ROS 2 parameter file", load)
      ->add_option("FILE", options->file, "The file")
      ->required();
  command->footer(
      "Example:\n"
      "  takt param list /lidar\n"
      "  takt param get /lidar rate_hz\n"
      "  takt param set /lidar rate_hz 20.0\n"
      "  takt param delete /lidar note\n"
      "  takt param describe /lidar rate_hz\n"
      "  takt param dump /lidar > lidar.yaml\n"
      "  takt param load /lidar lidar.yaml\n");
}
const Command registered("param", "Lists, shows and sets parameters of nodes, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::param_command
