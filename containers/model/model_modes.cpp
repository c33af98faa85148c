// The callbacks that a mode drops, in a model.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/model/model_builder.hpp"

namespace takt {

std::string ModelParts::why_dropped(std::size_t callback) const {
  return fmt::format("'{}' is dropped in this mode", model_.system.callbacks[callback].name);
}

// An overrun or a component may switch the mode, even if no client does. An overrun leads to a mode
// unless one further down is in force.
void AssumptionFinder::add_switches_of_modes() {
  const auto least = [](const std::optional<Nanoseconds>& one) {
    return one.value_or(Nanoseconds::max());
  };
  for (std::size_t mode = processes_.front().mode; mode < description_.modes.size(); ++mode) {
    const ModeDescription& next = description_.modes[mode];
    for (std::size_t i = 0; next.on_overrun && i < callbacks_.size(); ++i) {
      if (model_.system.callbacks[i].name != "/" + next.on_overrun->name || is_dropped(i)) continue;
      const CallbackParameters parameters = callbacks_[i]->parameters();
      const Nanoseconds longest = std::min(least(parameters.budget), least(parameters.deadline));
      const Nanoseconds shortest(model_.system.callbacks[i].least_execution);
      if (!may_run_[i] || shortest <= longest) continue;
      assume({.id = "nothing_is_changed",
              .state = Assumption::State::refuted,
              .text = fmt::format("each execution of {{}} takes {} or more, beyond its deadline or "
                                  "budget of {}, which leads to the mode '{}'",
                                  to_string(shortest), to_string(longest), next.name),
              .name = "'" + model_.system.callbacks[i].name + "'",
              .source = declared_at(next.on_overrun->where),
              .executor = {}});
    }
  }
  assume({.id = "nothing_is_changed",
          .state = if_watched(),
          .text =
              "no mode is switched: there is no bound from then on until all that was ready has "
              "been served",
          .name = {},
          .source = declared_at(description_.modes.front().where),
          .executor = {}});
}

// A dropped message is only picked and taken, which costs a dispatch.
void ModelBuilder::set_discarding(std::size_t index) {
  model_.callbacks[index].execution = Provenance::exact;
  model_.callbacks[index].given_up_after.reset();
  model_.callbacks[index].handled_after.reset();
}

// A dropped callback sends nothing. A join that waits for it never sends, which the chains find by
// this output.
void ModelBuilder::forget_outputs_of_dropped() {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (!is_dropped(i)) continue;
    std::erase_if(model_.system.callbacks[i].outputs, [&](const analysis::Output& output) {
      if (output.waits) return false;
      nothing_passes_[{i, output.to}] = why_dropped(i);
      return true;
    });
  }
}

}  // namespace takt
