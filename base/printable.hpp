// Text from other processes and files, for a terminal or a log.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_PRINTABLE_HPP_
#define TAKT_BASE_PRINTABLE_HPP_

#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

enum class Lines {
  escape,  // the text stays in one line
  keep,    // line breaks and tabs remain
};

/// The text with `\u001b` instead of a control character, and `\xff` instead of a byte that is no
/// UTF-8: what another process says must not steer the terminal, nor look like a line of ours.
/// Thread safety: from any thread. Real-time: allocates.
std::string printable(std::string_view text, Lines lines = Lines::escape);

}  // namespace takt

#endif  // TAKT_BASE_PRINTABLE_HPP_
