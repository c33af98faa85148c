// Puts a system under executors other than those of its file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_

#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_PUBLIC takt {

/// Gives an executor whose type takes a band of priorities (`preemptive`) one in place of its
/// threads: from the most urgent of them up to the next other thread of the file that may run on
/// its CPU. Returns how that differs from the file.
std::string take_band(ExecutorDescription& executor, SystemDescription& system);

/// Why the executors of this file fit no other one; empty: they do. There must be one executor,
/// which names no callbacks and has no reservation, or none and chains.
std::string why_it_fits_no_other(const SystemDescription& system);

/// Throws the Error that says so.
[[noreturn]] void throw_unfit(const std::string& name, const std::string& why);

/// The system as `other` would run it: all components on the executor of `other`; if that has
/// none, Takt assigns executors to the chains. The scheduler of `other` with its values, and its
/// `priorities`, which replace those of the system's file, come with it. All else remains.
/// The threads are those of the system's executors, in their order: an executor that has one thread
/// in `other` takes the first of them; one with several takes all, and the last of them again while
/// it has fewer than in `other`; one that isolates takes all. Where the system's executors name
/// none, they are those of `other`. Thread safety: none. Real-time: no. Errors: Error, if `other`
/// fits no other file.
SystemDescription replace_executors(SystemDescription system, const SystemDescription& other);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_
