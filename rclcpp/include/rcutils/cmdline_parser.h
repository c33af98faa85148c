// Options of a command line: a word, or a word with its value behind it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__CMDLINE_PARSER_H_
#define RCUTILS__CMDLINE_PARSER_H_

#include <algorithm>
#include <string_view>

inline bool rcutils_cli_option_exist(char** begin, char** end, const char* option) {
  return std::find(begin, end, std::string_view(option)) != end;
}

/// nullptr if there is no such option, or nothing behind it.
inline char* rcutils_cli_get_option(char** begin, char** end, const char* option) {
  char** const at = std::find(begin, end, std::string_view(option));
  return at == end || at + 1 == end ? nullptr : at[1];
}

#endif  // RCUTILS__CMDLINE_PARSER_H_
