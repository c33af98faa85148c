// ROS 2's messages and services for parameters, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_RCL_INTERFACES_HPP_
#define TAKT_MESSAGES_PACKAGES_RCL_INTERFACES_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/builtin_interfaces.hpp"

namespace takt::rcl_interfaces {

/// Which field of a ParameterValue holds the value.
enum class ParameterType : std::uint8_t {
  not_set = 0,
  boolean = 1,
  integer = 2,
  floating_point = 3,
  string = 4,
  byte_array = 5,
  boolean_array = 6,
  integer_array = 7,
  floating_point_array = 8,
  string_array = 9,
};

struct ParameterValue {
  std::uint8_t type = 0;  // a ParameterType
  bool bool_value = false;
  std::int64_t integer_value = 0;
  double double_value = 0;
  std::string string_value;
  std::vector<std::byte> byte_array_value;
  std::vector<bool> bool_array_value;
  std::vector<std::int64_t> integer_array_value;
  std::vector<double> double_array_value;
  std::vector<std::string> string_array_value;
};
TAKT_MESSAGE(ParameterValue, "rcl_interfaces/msg/ParameterValue", type, bool_value, integer_value,
             double_value, string_value, byte_array_value, bool_array_value, integer_array_value,
             double_array_value, string_array_value);

struct Parameter {
  std::string name;
  ParameterValue value;
};
TAKT_MESSAGE(Parameter, "rcl_interfaces/msg/Parameter", name, value);

/// What has changed at a node, on /parameter_events.
struct ParameterEvent {
  builtin_interfaces::Time stamp;
  std::string node;
  std::vector<Parameter> new_parameters, changed_parameters, deleted_parameters;
};
TAKT_MESSAGE(ParameterEvent, "rcl_interfaces/msg/ParameterEvent", stamp, node, new_parameters,
             changed_parameters, deleted_parameters);

enum class LogSeverity : std::uint8_t { debug = 10, info = 20, warn = 30, error = 40, fatal = 50 };

/// A line of a node's log, on /rosout.
struct Log {
  builtin_interfaces::Time stamp;
  std::uint8_t level = 0;  // a LogSeverity
  std::string name, msg, file, function;
  std::uint32_t line = 0;
};
TAKT_MESSAGE(Log, "rcl_interfaces/msg/Log", stamp, level, name, msg, file, function, line);

struct FloatingPointRange {
  double from_value = 0, to_value = 0, step = 0;
};
TAKT_MESSAGE(FloatingPointRange, "rcl_interfaces/msg/FloatingPointRange", from_value, to_value,
             step);

struct IntegerRange {
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
};
TAKT_MESSAGE(IntegerRange, "rcl_interfaces/msg/IntegerRange", from_value, to_value, step);

struct ParameterDescriptor {
  std::string name;
  std::uint8_t type = 0;  // a ParameterType
  std::string description, additional_constraints;
  bool read_only = false, dynamic_typing = false;
  std::vector<FloatingPointRange> floating_point_range;  // one at the most
  std::vector<IntegerRange> integer_range;               // one at the most
};
TAKT_MESSAGE(ParameterDescriptor, "rcl_interfaces/msg/ParameterDescriptor", name, type, description,
             additional_constraints, read_only, dynamic_typing, floating_point_range,
             integer_range);

struct SetParametersResult {
  bool successful = false;
  std::string reason;
};
TAKT_MESSAGE(SetParametersResult, "rcl_interfaces/msg/SetParametersResult", successful, reason);

struct ListParametersResult {
  std::vector<std::string> names, prefixes;
};
TAKT_MESSAGE(ListParametersResult, "rcl_interfaces/msg/ListParametersResult", names, prefixes);

struct GetParameters {
  struct Request {
    std::vector<std::string> names;
  };
  struct Response {
    std::vector<ParameterValue> values;
  };
};
TAKT_MESSAGE(GetParameters::Request, "rcl_interfaces/srv/GetParameters_Request", names);
TAKT_MESSAGE(GetParameters::Response, "rcl_interfaces/srv/GetParameters_Response", values);

struct GetParameterTypes {
  struct Request {
    std::vector<std::string> names;
  };
  struct Response {
    std::vector<std::uint8_t> types;
  };
};
TAKT_MESSAGE(GetParameterTypes::Request, "rcl_interfaces/srv/GetParameterTypes_Request", names);
TAKT_MESSAGE(GetParameterTypes::Response, "rcl_interfaces/srv/GetParameterTypes_Response", types);

struct SetParameters {
  struct Request {
    std::vector<Parameter> parameters;
  };
  struct Response {
    std::vector<SetParametersResult> results;
  };
};
TAKT_MESSAGE(SetParameters::Request, "rcl_interfaces/srv/SetParameters_Request", parameters);
TAKT_MESSAGE(SetParameters::Response, "rcl_interfaces/srv/SetParameters_Response", results);

struct SetParametersAtomically {
  struct Request {
    std::vector<Parameter> parameters;
  };
  struct Response {
    SetParametersResult result;
  };
};
TAKT_MESSAGE(SetParametersAtomically::Request, "rcl_interfaces/srv/SetParametersAtomically_Request",
             parameters);
TAKT_MESSAGE(SetParametersAtomically::Response,
             "rcl_interfaces/srv/SetParametersAtomically_Response", result);

struct ListParameters {
  struct Request {
    std::vector<std::string> prefixes;
    std::uint64_t depth = 0;  // 0: all the way down
  };
  struct Response {
    ListParametersResult result;
  };
};
TAKT_MESSAGE(ListParameters::Request, "rcl_interfaces/srv/ListParameters_Request", prefixes, depth);
TAKT_MESSAGE(ListParameters::Response, "rcl_interfaces/srv/ListParameters_Response", result);

struct DescribeParameters {
  struct Request {
    std::vector<std::string> names;
  };
  struct Response {
    std::vector<ParameterDescriptor> descriptors;
  };
};
TAKT_MESSAGE(DescribeParameters::Request, "rcl_interfaces/srv/DescribeParameters_Request", names);
TAKT_MESSAGE(DescribeParameters::Response, "rcl_interfaces/srv/DescribeParameters_Response",
             descriptors);

}  // namespace takt::rcl_interfaces

#endif  // TAKT_MESSAGES_PACKAGES_RCL_INTERFACES_HPP_
