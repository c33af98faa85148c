// How a message is initialised, under rosidl's name.
// SPDX-License-Identifier: Apache-2.0
#ifndef ROSIDL_RUNTIME_CPP__MESSAGE_INITIALIZATION_HPP_
#define ROSIDL_RUNTIME_CPP__MESSAGE_INITIALIZATION_HPP_

#include "takt/messages/message_type.hpp"

namespace rosidl_runtime_cpp {

using MessageInitialization = takt::MessageInitialization;

}  // namespace rosidl_runtime_cpp

#endif  // ROSIDL_RUNTIME_CPP__MESSAGE_INITIALIZATION_HPP_
