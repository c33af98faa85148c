// Words of a command line that Takt writes for a shell.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SHELL_WORD_HPP_
#define TAKT_TOOLS_TAKT_SHELL_WORD_HPP_

#include <string>

namespace takt::tools {

/// In quotes where a shell would take it for anything else than one word.
std::string shell_word(const std::string& text);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SHELL_WORD_HPP_
