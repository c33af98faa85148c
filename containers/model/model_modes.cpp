// What a mode leaves out of a model.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/containers/model/model_builder.hpp"

namespace takt {

std::string ModelParts::why_dropped(std::size_t callback) const {
  return fmt::format("'{}' is dropped in this mode", model_.system.callbacks[callback].name);
}

// An overrun or a component switches, if nobody else does.
void AssumptionFinder::add_switches_of_modes() {
  assume({.id = "nothing_is_changed",
          .state = if_watched(),
          .text =
              "no mode is switched: there is no bound from then on until all that was ready has "
              "been served",
          .name = {},
          .source = declared_at(description_.modes.front().where),
          .executor = {}});
}

// What a mode drops is picked and taken, which is what a dispatch takes.
void ModelBuilder::set_discarding(std::size_t index) {
  model_.callbacks[index].execution = Provenance::exact;
  model_.callbacks[index].given_up_after.reset();
  model_.callbacks[index].handled_after.reset();
}

// It sends nothing. A join for which it sends waits for ever: that the chains find by its output.
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
