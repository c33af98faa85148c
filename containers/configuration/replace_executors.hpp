// Puts a system under executors other than those of its file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_

#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_PUBLIC takt {

/// Replaces the threads of an executor whose type takes a band of priorities (`preemptive`) by a
/// band: from the most urgent of them up to the next other thread of the file that may run on its
/// CPU. Returns how the executor differs from the file.
std::string take_band(ExecutorDescription& executor, SystemDescription& system);

/// Why the executors of this file cannot serve another file; empty: they can. There must be one
/// executor, which names no callbacks and has no reservation, or no executor, but chains.
std::string why_it_fits_no_other(const SystemDescription& system);

/// Throws an Error with this reason.
[[noreturn]] void throw_unfit(const std::string& name, const std::string& why);

/// The system as `other` would run it: all components on the executor of `other`; if `other` has no
/// executor, Takt assigns executors to the chains. The scheduler of `other` with its values comes
/// with it, and so do its `priorities`, which replace those of the system's file. All else remains.
/// The threads are those of the system's executors, in their order: an executor that has one thread
/// in `other` takes the first of them; one with several takes all, and the last of them again while
/// it has fewer than in `other`; one that isolates takes all. If the system's executors name no
/// threads, those of `other` are taken. Thread safety: none. Real-time: no. Errors: Error, if
/// `other` fits no other file.
SystemDescription replace_executors(SystemDescription system, const SystemDescription& other);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_REPLACE_EXECUTORS_HPP_
