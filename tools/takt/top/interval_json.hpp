// What containers have done in an interval, as JSON.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TOP_INTERVAL_JSON_HPP_
#define TAKT_TOOLS_TAKT_TOP_INTERVAL_JSON_HPP_

#include <vector>

#include <nlohmann/json.hpp>

#include "top/watch.hpp"

namespace takt::tools::top {

/// One object: {"time": seconds since 1970, "containers": […]}. The words are those of results.
nlohmann::json interval_json(const std::vector<Watched>& containers);

}  // namespace takt::tools::top

#endif  // TAKT_TOOLS_TAKT_TOP_INTERVAL_JSON_HPP_
