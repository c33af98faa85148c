// Schedulers from shared libraries that the user names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_SCHEDULER_LIBRARY_HPP_
#define TAKT_SCHED_SCHEDULER_LIBRARY_HPP_

#include <string>

namespace takt {

/// Loads the library and adds to `schedulers()` the one that it registers under this name, after
/// check_scheduler(). What else it registers is added when it is asked for. `library` is as for
/// dlopen(3): with a slash it is a file, without one a name to search for. A library is never
/// unloaded; to ask again for what was added does nothing.
/// Throws Error, and adds nothing, when the library cannot be loaded, does not register the name or
/// does so twice, when the name is taken, or when the scheduler is not sound.
/// Thread safety: may be called from any thread.
/// Real-time: no.
void load_scheduler(const std::string& name, const std::string& library);

}  // namespace takt

#endif  // TAKT_SCHED_SCHEDULER_LIBRARY_HPP_
