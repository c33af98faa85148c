// The message between the three components.
// SPDX-License-Identifier: Apache-2.0
#ifndef PIPELINE_SAMPLE_HPP_
#define PIPELINE_SAMPLE_HPP_

#include <cstdint>

#include "takt/messages/message_type.hpp"

namespace pipeline {

struct Sample {
  std::int64_t number = 0;
  std::int64_t value = 0;
  bool is_last = false;
};
TAKT_MESSAGE(Sample, "pipeline/msg/Sample", number, value, is_last);

}  // namespace pipeline

#endif  // PIPELINE_SAMPLE_HPP_
