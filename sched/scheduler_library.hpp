// Loads schedulers from shared libraries.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_SCHEDULER_LIBRARY_HPP_
#define TAKT_SCHED_SCHEDULER_LIBRARY_HPP_

#include <string>

#include "takt/base/own_key.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Loads the library, checks the scheduler that it registers under this name (see check_scheduler),
/// and adds it to schedulers(). Other schedulers of the library are added by their own calls.
/// `library` is as for dlopen(3): with a slash it is a file, without one a name to search for. A
/// library is never unloaded; adding the same scheduler again has no effect.
/// Throws Error, and adds nothing, if the library cannot be loaded, does not register the name or
/// registers it twice, if the name is taken, or if the scheduler fails the check.
/// `own`: the values of its own keys, with which it is checked.
/// Thread safety: may be called from any thread.
/// Real-time: no.
void load_scheduler(const std::string& name, const std::string& library, const OwnValues& own = {});

}  // namespace takt

#endif  // TAKT_SCHED_SCHEDULER_LIBRARY_HPP_
