// Whether the callbacks of a process explain the messages that were sent in it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_SENT_MESSAGES_HPP_
#define TAKT_CONTAINERS_WATCHING_SENT_MESSAGES_HPP_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/model/system_model.hpp"

namespace TAKT_INTERNAL takt {

/// Compares, for each subscription and service with senders in its process, how much was sent to it
/// with what their executions send in the model. `begin`, and then `count` and `look` in turns:
/// what is sent is counted before the executions, so these are never fewer.
/// Thread safety: none. Real-time: no.
class SentMessages {
 public:
  struct Found {
    std::size_t to = 0;                // its place in the model
    std::uint64_t sent = 0, most = 0;  // since `begin`
  };

  SentMessages(const SystemModel& model, const ModelledProcess& process);

  void begin();
  void count();
  std::vector<Found> look(const std::vector<CallbackStatistics>& callbacks) const;

 private:
  struct Sender {
    std::string name;
    std::uint64_t messages = 0;   // of an execution
    std::uint64_t at_a_time = 0;  // executions that may have sent, and have not ended
  };
  struct Receiver {
    std::size_t place = 0;
    std::weak_ptr<const SubscriptionBase> end;
    std::vector<Sender> senders;
    std::optional<analysis::ArrivalCurve> others;  // what else may come
    std::uint64_t before = 0, now = 0;             // sent to it
  };
  TimePoint begun_{};
  std::vector<Receiver> receivers_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_SENT_MESSAGES_HPP_
