// takt reference: generates pages of the documentation from the code.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/reference.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/model/assumption.hpp"
#include "takt/containers/model/coverage.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "embedded.hpp"
#include "prompt/values.hpp"

namespace takt::tools::reference_command {
namespace {

using Row = std::array<std::string, 4>;

// Wider cells stick out instead of widening their column.
constexpr std::size_t kWidest = 70;

// Display width of UTF-8 text, good enough for this page.
std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return (byte & 0xc0) != 0x80; }));
}

std::string table(const ReferenceSection& section) {
  std::vector<Row> rows{{"key", "value", "default", "meaning"}};
  for (const ReferenceKey& key : section.keys) {
    const std::string otherwise = key.is_required             ? "needed"
                                  : key.default_value.empty() ? "–"
                                                              : key.default_value;
    rows.push_back({"`" + key.key + "`", key.value, otherwise, key.meaning});
  }
  std::string result;
  std::string line;
  for (const Row& row : rows) {
    for (std::size_t column = 0; column + 1 < row.size(); ++column) {
      const std::size_t own = width(row[column]);
      std::size_t widest = 0;
      for (const Row& other : rows) {
        if (width(other[column]) <= kWidest) widest = std::max(widest, width(other[column]));
      }
      result += "| " + row[column] + std::string(std::max(widest, own) - own + 1, ' ');
      line += "|" + std::string(widest + 2, '-');
    }
    result += "| " + row.back() + " |\n";  // the last column may be as long as it is
    if (&row == &rows.front()) result += line + "|---|\n";
  }
  return result;
}

void replace(std::string& page, const std::string& name, std::string_view text) {
  const std::string place = "{{" + name + "}}";
  const std::size_t at = page.find(place);
  if (at == std::string::npos) {
    throw Error(fmt::format("the page has no placeholder for '{}'", name),
                fmt::format("write {} into docs/reference/configuration.md.in", place));
  }
  page.replace(at, place.size(), text);
}

void add_tables(std::string& page, const std::string& prefix,
                const std::vector<ReferenceSection>& sections) {
  for (const ReferenceSection& section : sections) {
    std::string text = table(section);
    text.pop_back();  // the line ends in the page
    replace(page, prefix + section.title, text);
  }
}

// The anchor of a heading, "#a-thread": lower case, without other characters.
std::string anchor(std::string_view heading) {
  std::string result;
  for (const unsigned char sign : heading) {
    if (sign == ' ') result += '-';
    if (std::isalnum(sign) != 0 || sign == '-' || sign == '_') {
      result += static_cast<char>(std::tolower(sign));
    }
  }
  return result;
}

void check_links(const std::string& page) {
  std::vector<std::string> anchors;
  for (std::size_t at = page.find("\n#"); at != std::string::npos; at = page.find("\n#", at + 1)) {
    const std::size_t begin = page.find(' ', at) + 1;
    anchors.push_back(anchor(page.substr(begin, page.find('\n', begin) - begin)));
  }
  for (std::size_t at = page.find("](#"); at != std::string::npos; at = page.find("](#", at + 1)) {
    const std::string link = page.substr(at + 3, page.find(')', at) - at - 3);
    if (std::find(anchors.begin(), anchors.end(), link) == anchors.end()) {
      throw Error(fmt::format("the page has no heading for the link '#{}'", link),
                  "write it into docs/reference/configuration.md.in");
    }
  }
}

std::string configuration_reference() {
  std::string page = kConfigurationPage;
  add_tables(page, "", describe_configuration());
  add_tables(page, "workload: ", describe_workload());
  if (const std::size_t left = page.find("{{"); left != std::string::npos) {
    throw Error(fmt::format("the placeholder '{}' is unknown",
                            page.substr(left, page.find("}}", left) - left + 2)),
                "remove it from docs/reference/configuration.md.in");
  }
  check_links(page);
  return page;
}

std::string guarantees_reference() {
  std::string page =
      "# What a guarantee rests on\n\n"
      "`takt reference guarantees` makes this page of the tables that `takt analyze` uses. What "
      "the "
      "verdicts are:\n[takt analyze](command_line.md#takt-analyze-file); how the bounds come "
      "about: "
      "[bounds](../explanation/analysis.md).\n\n"
      "## Assumptions\n\n"
      "A chain is `guaranteed` if each of its assumptions is checked, or accepted in the file: "
      "`accept: {ID: 'why it holds'}`,\nat its top or in a chain. What a run, a component or this "
      "machine refutes cannot be accepted.\n\n"
      "| id | what is assumed | when Takt looks | what makes it needless |\n|---|---|---|---|\n";
  for (const AssumptionKind& kind : assumption_kinds()) {
    const auto or_dash = [](std::string_view text) { return text.empty() ? "–" : text; };
    page += fmt::format("| `{}` | {} | {} | {} |\n", kind.id, kind.meaning, or_dash(kind.check),
                        or_dash(kind.remedy));
  }
  page +=
      "\n## What counts, and how\n\n"
      "All that a file, a node, a thread and a measured run can say, and all that can change while "
      "a "
      "system runs. A chain\nwith something that is **not covered** has no guarantee, and `takt "
      "analyze` names it with its line. So is each key that a library\nbrings.\n";
  std::string_view before;
  for (const CoverageEntry& entry : coverage_table()) {
    if (entry.of != before) page += fmt::format("\n### {}\n\n", entry.of);
    before = entry.of;
    const char* const how = entry.coverage == Coverage::used         ? "used"
                            : entry.coverage == Coverage::irrelevant ? "cannot matter"
                                                                     : "**not covered**";
    page += fmt::format("- `{}`: {}: {}\n", entry.fact, how, entry.why);
  }
  return page;
}

void set_up(CLI::App* command) {
  const auto page = std::make_shared<std::string>();
  one_of(command
             ->add_option("PAGE", *page,
                          "config: the keys of configuration files, as Markdown; guarantees: what "
                          "those of takt analyze rest on")
             ->required(),
         {"config", "guarantees"});
  command->footer("Example:\n  takt reference config > docs/reference/configuration.md\n");
  command->callback([page] {
    rt::print("{}", *page == "config" ? configuration_reference() : guarantees_reference());
  });
}
const Command registered("reference", "Generates pages of the documentation from the code", set_up);

}  // namespace
}  // namespace takt::tools::reference_command
