// Programs of bytes: those that once showed a defect, and random ones.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_PROGRAMS_HPP_
#define TAKT_EXECUTORS_SEQUENCES_PROGRAMS_HPP_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/sequences/sequence.hpp"

namespace takt::sequences {

using Bytes = std::vector<std::uint8_t>;

/// The shortest program that showed a defect which is repaired since.
struct Kept {
  const char* name;
  Bytes bytes;
};
const std::vector<Kept>& kept_programs();

/// Runs this many random programs, or as many as TAKT_SEQUENCES says, each on an API of its own.
/// The seed is fixed, so a failure repeats. `often`: calls that they make more often than others.
/// Returns the first promise that was broken, with its program, or an empty string.
std::string run_random(int programs, const std::vector<Bytes>& often,
                       const std::function<std::unique_ptr<Api>()>& make_api);

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_PROGRAMS_HPP_
