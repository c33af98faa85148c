// Whether LTTng sees this process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LTTNG_HPP_
#define TAKT_CONTAINERS_LTTNG_HPP_

#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_INTERNAL takt {

/// Loads the tracepoints if the system has a thread `lttng`, whose attributes LTTng's threads get,
/// or the environment says TAKT_LTTNG=1. Call it before the first node is made. Returns the
/// attributes that Linux refused, or nothing. Throws Error if the tracepoints cannot be loaded.
/// Thread safety: from any thread. Real-time: no.
std::string load_tracepoints_if_asked(const SystemDescription* system);

}  // namespace takt

#endif  // TAKT_CONTAINERS_LTTNG_HPP_
