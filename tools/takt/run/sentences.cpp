// What the verdicts say, for a page.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "run/verdicts.hpp"

namespace takt::tools {

nlohmann::json sentences_json(std::span<const Compared> all) {
  nlohmann::json sentences = nlohmann::json::array();
  for (auto first = all.begin(); first != all.end();) {
    const auto end = std::find_if(first, all.end(),
                                  [&](const Compared& each) { return each.row != first->row; });
    sentences.push_back({{"file", first->row.file}, {"text", sentence({first, end})}});
    first = end;
  }
  return sentences;
}

}  // namespace takt::tools
