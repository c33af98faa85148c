// takt reference: generates pages of the documentation from the code.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/reference.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <type_traits>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/model/assumption.hpp"
#include "takt/containers/model/coverage.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/run_fields.hpp"

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

std::string table(const std::vector<Row>& rows) {
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

std::string table(const ReferenceSection& section) {
  std::vector<Row> rows{{"key", "value", "default", "meaning"}};
  for (const ReferenceKey& key : section.keys) {
    const std::string otherwise = key.is_required             ? "needed"
                                  : key.default_value.empty() ? "–"
                                                              : key.default_value;
    rows.push_back({"`" + key.key + "`", key.value, otherwise, key.meaning});
  }
  return table(rows);
}

void replace(std::string& page, const std::string& name, std::string_view text) {
  const std::string place = "{{" + name + "}}";
  const std::size_t at = page.find(place);
  if (at == std::string::npos) {
    throw Error(fmt::format("the page has no placeholder for '{}'", name),
                fmt::format("write {} into its .in file in docs/reference", place));
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
      "`accept: {ID: 'why it holds'}`,\nat its top or in a chain. `accept: {ID@DIGITS: 'why it "
      "holds'}`, with the digits that `takt analyze` prints\nof a chain, accepts only the "
      "sentences that stood there, for the callbacks that they name: others, after an edit of the\n"
      "file or another run, are to be read. Figures are no part of them. What the measured run or "
      "a "
      "component refutes cannot be accepted. Where the file's\n`machine` is not this one, the text "
      "of the assumption says what is here: accept it for the other machine only, as a\nrun on "
      "this one may break the bound.\n\n"
      "| id | what is assumed | when Takt looks | what makes it needless |\n|---|---|---|---|\n";
  for (const AssumptionKind& kind : assumption_kinds()) {
    const auto or_dash = [](std::string_view text) { return text.empty() ? "–" : text; };
    page += fmt::format("| `{}` | {} | {} | {} |\n", kind.id, kind.meaning,
                        or_dash(check_of(kind, true)), or_dash(remedy_of(kind, true)));
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

// ---- Results ----

template <class Value>
std::string kind_of(const std::string& key) {
  if constexpr (std::is_same_v<Value, Histogram>) return "distribution, µs";
  if constexpr (std::is_same_v<Value, bool>) return "true or false";
  if constexpr (std::is_same_v<Value, std::string> || std::is_enum_v<Value>) return "text";
  for (const auto& [end, unit] :
       {std::pair("_us", "µs"), {"_percent", "%"}, {"_kb", "kB"}, {"_s", "s"}}) {
    if (key.ends_with(end)) return unit;
  }
  if constexpr (std::is_arithmetic_v<Value>) return "count";
  if constexpr (std::is_same_v<Value, std::optional<std::uint64_t>>) return "count or null";
  return "–";
}

template <class Of>
std::string fields_table(const Of& row) {
  std::vector<Row> rows{{"key", "value", "two", "meaning"}};
  const auto add = [&]<Merge kHow, class Member, class Value>(const Field<kHow, Member>& field,
                                                              const Value& /*value*/) {
    rows.push_back({fmt::format("`{}`", field.name), kind_of<Value>(field.name),
                    kHow == Merge::keep  ? "–"
                    : kHow == Merge::sum ? "added"
                                         : "computed",
                    field.help});
  };
  for_each_field(add, row);
  std::string text = table(rows);
  text.pop_back();  // the line ends in the page
  return text;
}

std::string results_reference() {
  std::string page = kResultsPage;
  replace(page, "run", fields_table(rt::Run()));
  replace(page, "callbacks", fields_table(rt::Run::Callback()));
  replace(page, "chains", fields_table(rt::Run::Chain()));
  replace(page, "executors", fields_table(rt::Run::Executor()));
  replace(page, "threads", fields_table(rt::Run::Thread()));
  replace(page, "processes", fields_table(rt::Run::Process()));
  replace(page, "topics", fields_table(rt::Run::Topic()));
  return page;
}

/// What holds no objects of objects is on one line.
std::string schema_text(const nlohmann::ordered_json& schema, const std::string& indent) {
  const bool is_short =
      !schema.is_object() || std::none_of(schema.begin(), schema.end(), [](const auto& value) {
        return value.is_object() && !value.contains("$ref");
      });
  if (is_short) return rt::json_text(schema);
  std::string text = "{";
  for (const auto& [key, value] : schema.items()) {
    text += fmt::format("{}\n{}  \"{}\": {}", text == "{" ? "" : ",", indent, key,
                        schema_text(value, indent + "  "));
  }
  return text + "\n" + indent + "}";
}

std::string results_schema() {
  std::string page = kResultsSchema;
  replace(page, "run", schema_text(rt::run_schema(), "    "));
  return page;
}

void set_up(CLI::App* command) {
  const auto page = std::make_shared<std::string>();
  one_of(command
             ->add_option("PAGE", *page,
                          "config: the keys of configuration files; guarantees: what those of takt "
                          "analyze rest on; results: the figures in results, as Markdown; schema: "
                          "of results, as JSON")
             ->required(),
         {"config", "guarantees", "results", "schema"});
  command->footer("Example:\n  takt reference config > docs/reference/configuration.md\n");
  command->callback([page] {
    rt::print("{}", *page == "config"       ? configuration_reference()
                    : *page == "guarantees" ? guarantees_reference()
                    : *page == "results"    ? results_reference()
                                            : results_schema());
  });
}
const Command registered("reference", "Generates pages of the documentation from the code", set_up);

}  // namespace
}  // namespace takt::tools::reference_command
