// The order in which a simulated executor serves what is ready.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_ORACLE_ORDER_HPP_
#define TAKT_TESTING_ORACLE_ORDER_HPP_

#include <algorithm>
#include <tuple>
#include <vector>

#include "takt/analysis/system.hpp"

namespace takt::testing {

using analysis::Order;
using analysis::Time;

/// The callbacks of one executor that wait: for a thread, or parked, for one of their group.
class Waiting {
 public:
  struct Entry {
    std::size_t callback;
    Time ready;
    std::uint64_t sequence, window;
  };

  Waiting() = default;
  Waiting(const analysis::System& system, Order order) : system_(&system), order_(order) {}

  bool is_empty() const { return entries_.empty(); }
  void park(const Entry& entry) { parked_.push_back(entry); }
  void push(const Entry& entry) {
    const std::size_t group = at(entry.callback).group;
    if (std::find(turns_.begin(), turns_.end(), group) == turns_.end()) turns_.push_back(group);
    entries_.push_back(entry);
  }
  Entry pop() {
    const bool takes_turns = order_ == Order::in_turns;
    const auto first = first_of(entries_, [&](const Entry& entry) {
      return !takes_turns || at(entry.callback).group == turns_.front();
    });
    const Entry result = *first;
    entries_.erase(first);
    const std::size_t group = at(result.callback).group;
    std::erase(turns_, group);
    const bool has_more = std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return at(entry.callback).group == group;
    });
    if (has_more) turns_.push_back(group);
    return result;
  }
  /// A free group hands one of its callbacks back to the scheduler.
  void unpark(std::size_t group) {
    const auto first =
        first_of(parked_, [&](const Entry& entry) { return at(entry.callback).group == group; });
    if (first == parked_.end()) return;
    push(*first);
    parked_.erase(first);
  }

 private:
  const analysis::Callback& at(std::size_t callback) const { return system_->callbacks[callback]; }

  template <class IsMeant>
  std::vector<Entry>::iterator first_of(std::vector<Entry>& entries, const IsMeant& is_meant) {
    auto first = entries.end();
    for (auto entry = entries.begin(); entry != entries.end(); ++entry) {
      if (!is_meant(*entry)) continue;
      if (first == entries.end() || is_before(*entry, *first)) first = entry;
    }
    return first;
  }
  bool is_before(const Entry& a, const Entry& b) const {
    const analysis::Callback& first = at(a.callback);
    const analysis::Callback& second = at(b.callback);
    const auto point = [](const Entry& entry, const analysis::Callback& callback) {
      return analysis::plus(entry.ready, callback.point);
    };
    switch (order_) {
      case Order::by_urgency:
        return std::tuple(-first.urgency, a.sequence) < std::tuple(-second.urgency, b.sequence);
      case Order::by_point:
        return std::tuple(point(a, first), a.sequence) < std::tuple(point(b, second), b.sequence);
      case Order::in_windows:
        return std::tuple(a.window, first.place) < std::tuple(b.window, second.place);
      case Order::by_arrival:
      case Order::in_turns:
      case Order::arbitrary:
        break;
    }
    return a.sequence < b.sequence;
  }

  const analysis::System* system_ = nullptr;
  Order order_ = Order::arbitrary;
  std::vector<Entry> entries_, parked_;
  std::vector<std::size_t> turns_;  // groups
};

}  // namespace takt::testing

#endif  // TAKT_TESTING_ORACLE_ORDER_HPP_
