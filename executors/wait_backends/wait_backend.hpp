// How executor threads sleep and are woken.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_BACKENDS_WAIT_BACKEND_HPP_
#define TAKT_EXECUTORS_WAIT_BACKENDS_WAIT_BACKEND_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "takt/base/clock.hpp"
#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

/// A semaphore with a deadline: a post is never lost, and wakes one worker. Some back ends also
/// watch file descriptors. They report edges, not levels: a notified listener checks the descriptor
/// until it finds nothing, and is notified again of later events.
/// Thread safety: post, watch and unwatch from any thread; the rest from the worker of that index.
/// Real-time: post is one system call when a thread sleeps; nothing allocates after construction,
/// prepare and watch.
class WaitBackend {
 public:
  virtual ~WaitBackend() = default;
  /// Sleeps until a post (true), or the deadline has come or file descriptors were
  /// announced on this thread (false).
  virtual bool wait(std::size_t worker, TimePoint deadline) noexcept = 0;
  virtual void post() noexcept = 0;
  /// The calling thread, which has asked for these attributes, is that worker until it leaves.
  virtual void enter(std::size_t, const ThreadAttributes&) noexcept {}
  virtual void leave(std::size_t) noexcept {}

  virtual bool serves_file_descriptors() const noexcept { return false; }
  /// From here on `watch.listener` is notified of events of the descriptor; spurious notifications
  /// are possible. A descriptor that is ready already is an event. Throws Error.
  virtual void watch(const Watch&) {}
  /// The listener may be notified once more until all read sections that are open now have ended.
  virtual void unwatch(const ArrivalListener*) noexcept {}
  /// The calling thread is the one that will wait and look. Throws Error when that cannot be.
  virtual void prepare() {}
  /// Announces what is ready now, and does not wait. Returns true if there was something.
  virtual bool look() noexcept { return false; }
  /// A descriptor for another back end to watch: readable when `look` would find something; -1:
  /// none. For the thread that has called prepare.
  virtual int fd() noexcept { return -1; }
};

/// Properties of a wait back end that are known by its name.
struct WaitBackendTraits {
  bool serves_file_descriptors = false;
  std::size_t max_workers = SIZE_MAX;
  /// `auto` takes the suitable back end of the smallest cost. Costs rank the back ends by their
  /// measured wake-up. No value: taken only by its name.
  std::optional<int> cost = {};
};

using WaitBackendRegistry = Registry<WaitBackend, WaitBackendTraits, std::size_t>;
/// All wait back ends of this process by name, made for a number of workers. Making one throws
/// Error with the reason when this kernel does not grant it.
WaitBackendRegistry& wait_backends();

/// Leaves the choice to the executor: the cheapest back end that serves.
inline constexpr std::string_view kAutoWait = "auto";

/// Throws the error that lists the valid names when there is neither a back end of that name nor
/// is it kAutoWait.
void check_wait_backend(std::string_view name);

/// The back end of that name; with kAutoWait the one of least cost that serves as many workers, and
/// file descriptors where there are some. With a manual clock the clock's own back end, and any
/// name but kAutoWait is an Error.
std::unique_ptr<WaitBackend> make_wait_backend(std::string_view name, Clock& clock,
                                               std::size_t workers, bool has_file_descriptors);

/// Adds the back end to `wait_backends()`; while load_wait_backend() loads a library, only notes it
/// for that call. Always true. Throws Error when the name is taken.
bool register_wait_backend(std::string name, WaitBackendRegistry::Entry entry, const char* version);

/// At namespace scope in a .cpp file: makes `Class` known as `name`. Its constructor takes the
/// number of workers. The traits follow the class.
#define TAKT_REGISTER_WAIT_BACKEND(name, description, Class, ...)                              \
  namespace {                                                                                  \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_wait_backend_) = ::takt::register_wait_backend( \
      name,                                                                                    \
      {description, [](std::size_t workers) { return std::make_unique<Class>(workers); },      \
       ::takt::WaitBackendTraits{__VA_ARGS__}},                                                \
      TAKT_VERSION);                                                                           \
  }

/// Loads the library, tries the wait back end that it registers under this name, and adds it to
/// wait_backends(). `library` is as for load_scheduler(). Throws Error, and adds nothing, if the
/// library cannot be loaded, does not register the name or registers it twice, if the name is
/// taken, if a post does not end exactly one wait, or if a wait does not return within 5 s. The
/// conformance suite tests the rest. Thread safety: may be called from any thread. Real-time: no.
void load_wait_backend(const std::string& name, const std::string& library);

}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_BACKENDS_WAIT_BACKEND_HPP_
