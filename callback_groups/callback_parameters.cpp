// SPDX-License-Identifier: Apache-2.0
#include "takt/callback_groups/callback_parameters.hpp"

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

void check_positive(const char* what, const std::optional<Nanoseconds>& value) {
  if (!value || *value > Nanoseconds::zero()) return;
  throw Error(fmt::format("a {} of {} cannot be kept", what, to_string(*value)),
              "leave it out, or give a positive one");
}

void check_order(const char* less, Nanoseconds small, const char* more, Nanoseconds large) {
  if (small <= large) return;
  throw Error(fmt::format("the {} of {} is above the {} of {}", less, to_string(small), more,
                          to_string(large)),
              fmt::format("choose {} ≤ {}", less, more));
}

}  // namespace

const std::vector<std::pair<std::string, OverrunPolicy>>& overrun_policies() {
  static const std::vector<std::pair<std::string, OverrunPolicy>> policies{
      {"catch_up", OverrunPolicy::catch_up},
      {"skip", OverrunPolicy::skip},
      {"abort", OverrunPolicy::abort},
      {"demote", OverrunPolicy::demote}};
  return policies;
}

CallbackParameters CallbackParameters::or_else(const CallbackParameters& others) const {
  CallbackParameters result = *this;
  const auto fill = [](auto& value, const auto& other) {
    if (!value) value = other;
  };
  fill(result.priority, others.priority);
  fill(result.deadline, others.deadline);
  fill(result.period, others.period);
  fill(result.budget, others.budget);
  fill(result.criticality, others.criticality);
  fill(result.overrun, others.overrun);
  fill(result.releases, others.releases);
  fill(result.serving, others.serving);
  fill(result.on_deadline_miss, others.on_deadline_miss);
  fill(result.on_overrun, others.on_overrun);
  return result;
}

void CallbackParameters::check(Nanoseconds own_period) const {
  check_positive("deadline", deadline);
  check_positive("period", period);
  check_positive("budget", budget);
  if (releases.value_or(1) < 1)
    throw Error(fmt::format("{} releases cannot wait", *releases), "give 1 or more");
  const Nanoseconds known =
      own_period != Nanoseconds::zero() ? own_period : period.value_or(Nanoseconds::zero());
  if (!budget) return;
  if (deadline) check_order("budget", *budget, "deadline", *deadline);
  if (known != Nanoseconds::zero()) check_order("budget", *budget, "period", known);
}

}  // namespace takt
