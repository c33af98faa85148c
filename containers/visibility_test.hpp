// What visibility_test.cpp and its two libraries define, each for itself.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_VISIBILITY_TEST_HPP_
#define TAKT_CONTAINERS_VISIBILITY_TEST_HPP_

#include <cstdint>
#include <string>

#include "takt/messages/message_type.hpp"

namespace hidden {

struct Reading {
  std::int32_t number = 0;
  std::string unit;
};
TAKT_MESSAGE(Reading, "hidden/msg/Reading", number, unit);

struct Answer {
  std::string text;
};
TAKT_MESSAGE(Answer, "hidden/msg/Answer", text);

}  // namespace hidden

#endif  // TAKT_CONTAINERS_VISIBILITY_TEST_HPP_
