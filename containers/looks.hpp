// Threads that look at the components of a container.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOOKS_HPP_
#define TAKT_CONTAINERS_LOOKS_HPP_

#include <future>
#include <memory>
#include <utility>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Readers of a container's component list, as in RCU: a look may keep pointers to components, so
/// unloading a component waits for all looks that have begun before. Thread safety: none, but a
/// look may end on any thread. Real-time: no.
class Looks {
 public:
  /// A look ends when this is dropped. Drop it after the pointers that the look has found.
  using Look = std::shared_ptr<const void>;
  Look begin() const { return present_; }
  /// Ready when all looks that have begun so far have ended.
  std::future<void> end_of_present() {
    const auto past = std::exchange(present_, std::make_shared<Generation>());
    past->next = present_;
    return past->over.get_future();
  }

 private:
  struct Generation {
    ~Generation() { over.set_value(); }
    std::shared_ptr<Generation> next;  // so that generations end in order
    std::promise<void> over;
  };
  std::shared_ptr<Generation> present_ = std::make_shared<Generation>();
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_LOOKS_HPP_
