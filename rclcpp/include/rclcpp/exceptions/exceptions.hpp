// The exceptions of rclcpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXCEPTIONS__EXCEPTIONS_HPP_
#define RCLCPP__EXCEPTIONS__EXCEPTIONS_HPP_

#include <stdexcept>
#include <string>
#include <vector>

#include "rcl/types.h"

namespace rclcpp::exceptions {

/// A name, and what is wrong with it.
class NameValidationError : public std::invalid_argument {
 public:
  NameValidationError(const char* kind, const char* name_, const char* message, std::size_t index)
      : std::invalid_argument("Invalid " + std::string(kind) + ": " + message),
        name_type(kind),
        name(name_),
        error_msg(message),
        invalid_index(index) {}

  const std::string name_type, name, error_msg;
  const std::size_t invalid_index;
};
class InvalidNodeNameError : public NameValidationError {
 public:
  InvalidNodeNameError(const char* of, const char* message, std::size_t index = 0)
      : NameValidationError("node name", of, message, index) {}
};
class InvalidNamespaceError : public NameValidationError {
 public:
  InvalidNamespaceError(const char* of, const char* message, std::size_t index = 0)
      : NameValidationError("namespace", of, message, index) {}
};
class InvalidTopicNameError : public NameValidationError {
 public:
  InvalidTopicNameError(const char* of, const char* message, std::size_t index = 0)
      : NameValidationError("topic name", of, message, index) {}
};
class InvalidServiceNameError : public NameValidationError {
 public:
  InvalidServiceNameError(const char* of, const char* message, std::size_t index = 0)
      : NameValidationError("service name", of, message, index) {}
};

class InvalidNodeError : public std::runtime_error {
 public:
  InvalidNodeError() : std::runtime_error("node is invalid") {}
};

class RCLErrorBase {
 public:
  RCLErrorBase(rcl_ret_t code, std::string text)
      : ret(code), message(std::move(text)), formatted_message(message) {}
  virtual ~RCLErrorBase() = default;
  rcl_ret_t ret;
  std::string message, file, formatted_message;
  std::size_t line = 0;
};
class RCLError : public RCLErrorBase, public std::runtime_error {
 public:
  RCLError(rcl_ret_t code, const std::string& text)
      : RCLErrorBase(code, text), std::runtime_error(text) {}
};
class RCLInvalidArgument : public RCLErrorBase, public std::invalid_argument {
 public:
  RCLInvalidArgument(rcl_ret_t code, const std::string& text)
      : RCLErrorBase(code, text), std::invalid_argument(text) {}
};

/// Unknown arguments after `--ros-args`.
class UnknownROSArgsError : public std::runtime_error {
 public:
  explicit UnknownROSArgsError(std::vector<std::string> unknown)
      : std::runtime_error(describe(unknown)), unknown_ros_args(std::move(unknown)) {}
  const std::vector<std::string> unknown_ros_args;

 private:
  static std::string describe(const std::vector<std::string>& unknown) {
    std::string text = "found unknown ROS arguments:";
    for (const auto& argument : unknown) text += " '" + argument + "'";
    return text;
  }
};
class RCLInvalidROSArgsError : public RCLError {
 public:
  explicit RCLInvalidROSArgsError(const std::string& text) : RCLError(RCL_RET_ERROR, text) {}
};

class UnsupportedEventTypeException : public RCLError {
 public:
  using RCLError::RCLError;
};

#define RCLCPP_EXCEPTION_(Name)              \
  class Name : public std::runtime_error {   \
   public:                                   \
    using std::runtime_error::runtime_error; \
  };
RCLCPP_EXCEPTION_(EventNotRegisteredException)
RCLCPP_EXCEPTION_(InvalidParametersException)
RCLCPP_EXCEPTION_(InvalidParameterValueException)
RCLCPP_EXCEPTION_(ParameterAlreadyDeclaredException)
RCLCPP_EXCEPTION_(ParameterNotDeclaredException)
RCLCPP_EXCEPTION_(ParameterImmutableException)
RCLCPP_EXCEPTION_(ParameterModifiedInCallbackException)
RCLCPP_EXCEPTION_(UnimplementedError)
#undef RCLCPP_EXCEPTION_

class InvalidParameterTypeException : public std::runtime_error {
 public:
  InvalidParameterTypeException(const std::string& name, const std::string& message)
      : std::runtime_error("parameter '" + name + "' has invalid type: " + message) {}
};
class UninitializedStaticallyTypedParameterException : public InvalidParameterTypeException {
 public:
  explicit UninitializedStaticallyTypedParameterException(const std::string& name)
      : InvalidParameterTypeException(
            name, "cannot declare a statically typed parameter with an uninitialized value") {}
};
class ParameterUninitializedException : public std::runtime_error {
 public:
  explicit ParameterUninitializedException(const std::string& name)
      : std::runtime_error("parameter '" + name + "' is not initialized") {}
};

/// Does not return.
[[noreturn]] inline void throw_from_rcl_error(rcl_ret_t code, const std::string& prefix = "") {
  throw RCLError(code, prefix);
}

}  // namespace rclcpp::exceptions

namespace rclcpp {
using exceptions::InvalidParameterTypeException;
}

#endif  // RCLCPP__EXCEPTIONS__EXCEPTIONS_HPP_
