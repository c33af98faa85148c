// SPDX-License-Identifier: Apache-2.0
#include "rta/json_lines.hpp"

#include <algorithm>
#include <cstdio>
#include <iostream>

#include <fmt/format.h>

#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

// Limit: bytes of a task set on stdin, or of a line. At it: it is refused. Seen: the error.
constexpr std::size_t kMostLineBytes = 4 << 20;

[[noreturn]] void refuse_length(const document::Errors& errors, const char* what) {
  errors.fail(1, fmt::format("the {} has more than {} bytes", what, kMostLineBytes),
              "give fewer tasks");
}

/// The next line of stdin, without its end.
bool read_line(std::string& line, const document::Errors& errors) {
  line.clear();
  for (int next = std::cin.get(); next != std::istream::traits_type::eof(); next = std::cin.get()) {
    if (next == '\n') return true;
    if (line.size() == kMostLineBytes) refuse_length(errors, "line");
    line.push_back(static_cast<char>(next));
  }
  return !line.empty();
}

/// What only the result has again, and no analysis reads.
void move_to(json& result, document::Value& value, const char* key) {
  auto* const map = std::get_if<document::Map>(&value.content);
  if (map == nullptr) return;
  const auto found = std::find_if(map->values.begin(), map->values.end(),
                                  [key](const document::Value& one) { return one.name == key; });
  if (found == map->values.end()) return;
  if (const auto* text = std::get_if<std::string>(&found->content)) result[key] = *text;
  if (const auto* whole = std::get_if<std::int64_t>(&found->content)) result[key] = *whole;
  if (const auto* real = std::get_if<double>(&found->content)) result[key] = *real;
  map->values.erase(found);
}

}  // namespace

std::string read_stdin(const document::Errors& errors) {
  std::string text(kMostLineBytes + 1, ' ');
  std::cin.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::cin.gcount()));
  if (text.size() > kMostLineBytes) refuse_length(errors, "input");
  return text;
}

void answer_lines(const std::string& inputs, const LineAnswer& answer) {
  std::string line;
  std::size_t number = 0, refused = 0;
  while (read_line(line, document::Errors(fmt::format("stdin:{}", number + 1)))) {
    ++number;
    try {
      document::Errors errors(fmt::format("stdin:{}", number));
      document::Value value = document::parse_json(line, errors);
      errors.throw_if_any();
      json result{{"id", number}};
      move_to(result, value, "id");
      move_to(result, value, "utilisation");
      answer(value, errors, result);
      rt::print("{}\n", rt::json_text(result));
      if (std::fflush(stdout) != 0) return;  // nobody reads it any more; the end of main() says so
    } catch (const ConfigurationError& error) {  // those of other people's sets do not end the rest
      ++refused;
      rt::to_stderr("{}\n", error.what());
    }
  }
  if (refused == 0) return;
  throw Error(fmt::format("{} of {} lines are no {}", refused, number, inputs),
              "see the messages above");
}

}  // namespace takt::tools
