// The messages of programs of bytes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_SEQUENCE_TYPES_HPP_
#define TAKT_EXECUTORS_SEQUENCES_SEQUENCE_TYPES_HPP_

#include "takt/messages/message_type.hpp"

namespace takt::sequences {

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test/msg/Sequenced", value);

struct Twice {
  struct Request {
    int value = 0;
  };
  struct Response {
    int value = 0;
  };
};
TAKT_MESSAGE(Twice::Request, "test/srv/SequencedTwice_Request", value);
TAKT_MESSAGE(Twice::Response, "test/srv/SequencedTwice_Response", value);

struct Count {
  struct Goal {
    int number = 0;
  };
  struct Result {
    int number = 0;
  };
  struct Feedback {
    int number = 0;
  };
};
TAKT_MESSAGE(Count::Goal, "test/action/SequencedCount_Goal", number);
TAKT_MESSAGE(Count::Result, "test/action/SequencedCount_Result", number);
TAKT_MESSAGE(Count::Feedback, "test/action/SequencedCount_Feedback", number);

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_SEQUENCE_TYPES_HPP_
