// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace libstatistics_collector {
struct Collector {};
}  // namespace libstatistics_collector
