// The callbacks that a mode drops, in a model.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/containers/model/model_builder.hpp"

namespace takt {

std::string ModelParts::why_dropped(std::size_t callback) const {
  return fmt::format("'{}' is dropped in this mode", model_.system.callbacks[callback].name);
}

// An overrun or a component may switch the mode, even if no client does.
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
