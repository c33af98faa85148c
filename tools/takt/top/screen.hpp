// The terminal on which `takt top` shows its lines.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TOP_SCREEN_HPP_
#define TAKT_TOOLS_TAKT_TOP_SCREEN_HPP_

#include <cstddef>
#include <optional>
#include <vector>

#include "top/view.hpp"

namespace takt::tools::top {

/// Takes the terminal over as long as it lives, and gives it back as it was.
/// Thread safety: one thread. A process has one.
/// Real-time: no.
class Screen {
 public:
  /// Throws Error if the terminal (TERM) is not known.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  bool has_blocks() const noexcept { return has_blocks_; }
  /// With as many lines as it is high now, each as wide.
  void draw(View& view);
  /// One that was pressed, or that the window has another size now; nothing: none.
  std::optional<int> key();

 private:
  bool has_blocks_ = false;
};

}  // namespace takt::tools::top

#endif  // TAKT_TOOLS_TAKT_TOP_SCREEN_HPP_
