// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/key_reader.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/model/assumption.hpp"

namespace takt {

SystemReader::Read KeyReader::noting(bool& is_sound, Read read) {
  return [this, &is_sound, read = std::move(read)](const Value& value) {
    const std::size_t before = errors_.size();
    read(value);
    is_sound &= errors_.size() == before;
  };
}

SystemReader::Read KeyReader::into_duration(Nanoseconds& duration, std::function<void()> check) {
  return [this, &duration, check = std::move(check)](const Value& value) {
    const bool is_set = duration != Nanoseconds::zero();
    if (describes("duration", is_set ? fmt::format("`{}`", to_string(duration)) : "")) return;
    const auto* text = std::get_if<std::string>(&value.content);
    if (text == nullptr) {
      return refuse(value, "a number and one of ns, us, ms, s, m, h, such as 20ms");
    }
    errors_.passes(value.line, [&] {
      duration = parse_duration(*text);
      check();
    });
  };
}

SystemReader::Read KeyReader::into_duration(std::optional<Nanoseconds>& duration,
                                            std::function<void()> check) {
  return without_default([this, &duration, check = std::move(check)] {
    return into_duration(duration.emplace(), check);
  });
}

namespace {

bool is_hexadecimal(std::string_view digits) {
  constexpr std::size_t kDigits = 8;
  return digits.size() == kDigits && digits.find_first_not_of("0123456789abcdef") == digits.npos;
}

}  // namespace

SystemReader::Read KeyReader::into_accepted(Acceptances& accepted) {
  return each_in_map([this, &accepted](const Value& value) {
    if (is_describing()) return void(describes("text"));
    const auto [id, sentences] = split_accepted(value.name);
    if (assumption_kind(id) == nullptr) {
      std::vector<std::string> ids;
      for (const AssumptionKind& kind : assumption_kinds()) ids.emplace_back(kind.id);
      errors_.add(value.line, fmt::format("no assumption is called '{}'", id),
                  suggest(std::string(id), ids));
      return;
    }
    if (id.size() != value.name.size() && !is_hexadecimal(sentences)) {
      errors_.add(value.line, fmt::format("'{}' stands for no sentences", value.name),
                  fmt::format("write '{}@' and the 8 digits that `takt analyze` prints", id));
    }
    std::string& reason = accepted[value.name];
    into(reason)(value);
    if (printable(reason) != reason) {
      errors_.add(value.line, "the reason is no line of text", "write it in one line");
    } else if (!reason.empty() && reason.find_first_not_of(' ') == reason.npos) {
      errors_.add(value.line, "the reason is blank", "write why it holds");
    }
  });
}

SystemReader::Read KeyReader::into_executor(std::string& target) {
  return into_checked(target, [this, &target] {
    if (file_.executors.contains(target)) return;
    throw Error(fmt::format("no executor is called '{}'", target),
                suggest(target, std::vector(file_.executors.begin(), file_.executors.end())));
  });
}

// dlopen resolves a path from the current directory and a bare name in system folders only; the
// file's own folder comes first here.
void KeyReader::read_library(const Value& value, std::string& library) {
  into(library)(value);
  if (library.empty()) return;
  const std::string path = beside(library);
  std::error_code too_long;  // for the name of a file
  if (library.find('/') != std::string::npos || std::filesystem::exists(path, too_long)) {
    library = path;
  }
  if (file_.policy != nullptr) {
    library = file_.policy->permitted(library);
  } else {
    system_.libraries.push_back(real_library(library));
  }
}

std::string KeyReader::beside(const std::string& path) const {
  return std::filesystem::absolute(errors_.file()).parent_path() / path;
}

bool KeyReader::passes(const Value& map, std::string_view key, const std::function<void()>& check) {
  const Value* place = document::find(map, key);
  return errors_.passes((place != nullptr ? *place : map).line, check);
}

void KeyReader::check_is_some(const Value& list) {
  if (document::is_empty_list(&list))
    errors_.add(list.line, "the list of CPUs is empty", "name at least one, or leave it out");
}

}  // namespace takt
