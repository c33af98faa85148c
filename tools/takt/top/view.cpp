// SPDX-License-Identifier: Apache-2.0
#include "top/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/printable.hpp"

namespace takt::tools::top {
namespace {

// Limit: intervals of a row's history. At it: the oldest goes. Seen: the line.
constexpr std::size_t kMostHistory = 200;
// Limit: characters of a filter. At it: further ones are ignored. Seen: the line.
constexpr std::size_t kMostFilter = 60;
constexpr std::size_t kFixedLines = 6;  // besides the rows
constexpr std::size_t kLeastName = 24;

// Characters on the screen of UTF-8.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return (byte & '\xc0') != '\x80'; }));
}

std::string cut(std::string text, std::size_t width) {
  if (width_of(text) <= width) return text;
  std::size_t bytes = 0;
  for (std::size_t shown = 0; bytes < text.size(); ++bytes) {
    if ((text[bytes] & '\xc0') != '\x80' && shown++ == width) break;
  }
  text.resize(bytes);
  return text;
}

std::string padded(const std::string& text, std::size_t width, bool is_number) {
  const std::string part = cut(text, width);
  const std::string space(width - width_of(part), ' ');
  return is_number ? space + part : part + space;
}

// As people count: name_2 comes before name_10.
bool comes_before(std::string_view a, std::string_view b) {
  const auto number_of = [](std::string_view text) {
    return text.substr(0, std::min(text.find_first_not_of("0123456789"), text.size()));
  };
  while (!a.empty() && !b.empty()) {
    const std::string_view one = number_of(a), other = number_of(b);
    if (one.empty() || other.empty()) {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1);
      b.remove_prefix(1);
      continue;
    }
    const auto digits = [](std::string_view number) {
      return number.substr(std::min(number.find_first_not_of('0'), number.size()));
    };
    if (digits(one).size() != digits(other).size())
      return digits(one).size() < digits(other).size();
    if (digits(one) != digits(other)) return digits(one) < digits(other);
    a.remove_prefix(one.size());
    b.remove_prefix(other.size());
  }
  return a.size() < b.size();
}

// How much of the begin all names have, up to a '/', which is kept.
std::size_t common_prefix(const std::vector<const Row*>& rows) {
  if (rows.size() < 2) return 0;
  std::string_view prefix = rows.front()->cells[0].text;
  for (const Row* row : rows) {
    const std::string& name = row->cells[0].text;
    const auto end = std::mismatch(prefix.begin(), prefix.end(), name.begin(), name.end()).first;
    prefix = prefix.substr(0, static_cast<std::size_t>(end - prefix.begin()));
  }
  const std::size_t slash = prefix.rfind('/');
  return slash == prefix.npos ? 0 : slash;
}

// Names differ at their end more often than in their middle.
std::string shortened(const std::string& name, std::size_t width, const std::string& gap) {
  if (width_of(name) <= width || width <= 2 * width_of(gap)) return cut(name, width);
  const std::size_t begin = (width - width_of(gap)) / 3;
  const std::size_t rest = width - width_of(gap) - begin;
  std::size_t end = name.size();
  for (std::size_t shown = 0; end > 0 && shown < rest;) {
    if ((name[--end] & '\xc0') != '\x80') ++shown;
  }
  return cut(name, begin) + gap + name.substr(end);
}

constexpr std::array kHelp{
    "q           quit",
    "1-6, Tab    table: threads, executors, callbacks, chains, topics, bounds",
    "arrows      up and down: the row; left and right: the column that sorts and has a history",
    "PgUp, PgDn  a page of rows; Home and End: the first and the last one",
    "r           sort the other way round",
    "/           rows that have these letters; Esc: all",
    "p, Space    pause, and go on",
    "?           this page, and back",
    "",
    "Times are in us, of the last interval. '!': deadlines were missed, or messages dropped.",
    "Where a line is too short, columns left of the chosen one, and what all names begin with, are",
    "left out."};

}  // namespace

std::string sparkline(const std::deque<double>& values, std::size_t width, bool has_blocks) {
  static constexpr std::array kBlocks{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  static constexpr std::array kLetters{"_", "_", ".", ".", "-", "-", "=", "#"};
  const std::size_t count = std::min(width, values.size());
  const auto first = values.end() - static_cast<std::ptrdiff_t>(count);
  if (count == 0) return "";
  const auto [low, high] = std::minmax_element(first, values.end());
  std::string line;
  for (auto value = first; value != values.end(); ++value) {
    const double part = *high > *low ? (*value - *low) / (*high - *low) : 0;
    const auto level = static_cast<std::size_t>(std::lround(part * (kBlocks.size() - 1)));
    line += (has_blocks ? kBlocks : kLetters)[level];
  }
  return line;
}

View::View(bool has_blocks)
    : has_blocks_(has_blocks),
      newest_(tables_of({})),
      tables_(newest_),
      choices_(newest_.size()),
      histories_(newest_.size()) {
}

void View::show(const std::vector<Watched>& containers) {
  newest_ = tables_of(containers);
  remember();
  if (is_paused_) return;
  containers_ = containers;
  tables_ = newest_;
}

// Of rows that have gone nothing is kept.
void View::remember() {
  for (std::size_t i = 0; i < newest_.size(); ++i) {
    History now;
    for (const Row& row : newest_[i].rows) {
      auto& columns = now[row.key] = std::move(histories_[i][row.key]);
      columns.resize(row.cells.size());
      for (std::size_t c = newest_[i].first_number; c < row.cells.size(); ++c) {
        if (!row.is_new) continue;
        columns[c].push_back(row.cells[c].value);
        if (columns[c].size() > kMostHistory) columns[c].pop_front();
      }
    }
    histories_[i] = std::move(now);
  }
}

// ---- Keys ----

bool View::press(int key) {
  if (is_filtering_) return press_in_filter(key);
  switch (key) {
    case 'q':
      return false;
    case '\t':
      current_ = (current_ + 1) % tables_.size();
      break;
    case kLeft:
      choose(-1);
      break;
    case kRight:
      choose(1);
      break;
    case 'r':
      choice().is_reversed = !choice().is_reversed;
      break;
    case 'p':
    case ' ':
      is_paused_ = !is_paused_;
      if (!is_paused_) tables_ = newest_;
      break;
    case '/':
      is_filtering_ = true;
      break;
    case '?':
      shows_help_ = !shows_help_;
      break;
    case kEscape:
      filter_.clear();
      break;
    case kUp:
      move(-1);
      break;
    case kDown:
      move(1);
      break;
    case kPageUp:
      move(-static_cast<std::ptrdiff_t>(page_));
      break;
    case kPageDown:
      move(static_cast<std::ptrdiff_t>(page_));
      break;
    case kHome:
      move(PTRDIFF_MIN / 2);
      break;
    case kEnd:
      move(PTRDIFF_MAX / 2);
      break;
    default:
      if (key >= '1' && key < '1' + static_cast<int>(tables_.size())) {
        current_ = static_cast<std::size_t>(key - '1');
      }
  }
  return true;
}

bool View::press_in_filter(int key) {
  if (key == '\n' || key == '\r') {
    is_filtering_ = false;
  } else if (key == kEscape) {
    is_filtering_ = false;
    filter_.clear();
  } else if (key == kErase) {
    if (!filter_.empty()) filter_.pop_back();
  } else if (key >= ' ' && key < 127 && filter_.size() < kMostFilter) {
    filter_ += static_cast<char>(key);
  }
  return true;
}

void View::choose(std::ptrdiff_t by) {
  const auto columns = static_cast<std::ptrdiff_t>(table().columns.size());
  std::size_t& column = choice().column;
  do {
    column =
        static_cast<std::size_t>((static_cast<std::ptrdiff_t>(column) + by + columns) % columns);
  } while (!is_shown(column));
}

// It stays selected while rows change their places; the first one instead of one that has gone.
std::size_t View::place_of_selected(const std::vector<const Row*>& rows) const {
  const auto selected = std::find_if(rows.begin(), rows.end(), [&](const Row* row) {
    return row->key == choices_[current_].selected;
  });
  return selected == rows.end() ? 0 : static_cast<std::size_t>(selected - rows.begin());
}

void View::move(std::ptrdiff_t by) {
  const std::vector<const Row*> all = rows();
  if (all.empty()) return;
  const auto to = std::clamp<std::ptrdiff_t>(
      static_cast<std::ptrdiff_t>(place_of_selected(all)) + by, 0, std::ssize(all) - 1);
  choice().selected = all[static_cast<std::size_t>(to)]->key;
}

// ---- Lines ----

// Those that have the filter's letters in a cell; numbers sorted from the largest.
std::vector<const Row*> View::rows() const {
  std::vector<const Row*> rows;
  for (const Row& row : table().rows) {
    const auto has_it = [&](const Cell& cell) {
      return printable(cell.text).find(filter_) != std::string::npos;
    };
    if (std::any_of(row.cells.begin(), row.cells.end(), has_it)) rows.push_back(&row);
  }
  const Choice& chosen = choices_[current_];
  const std::size_t column = chosen.column;
  const bool is_number = column >= table().first_number;
  std::stable_sort(rows.begin(), rows.end(), [&](const Row* a, const Row* b) {
    if (a->mark.empty() != b->mark.empty()) return a->mark.empty();  // old ones come last
    if (chosen.is_reversed) std::swap(a, b);
    return is_number ? a->cells[column].value > b->cells[column].value
                     : comes_before(a->cells[column].text, b->cells[column].text);
  });
  return rows;
}

// Where all is too wide, names give way, then columns in front of the chosen one, which get the
// width 0, and then the last ones.
std::vector<std::size_t> View::widths(const std::vector<const Row*>& rows, std::size_t most) const {
  std::vector<std::size_t> widths;
  std::size_t all = 1;
  for (std::size_t c = 0; c < table().columns.size(); ++c) {
    widths.push_back(table().columns[c].title.size() + 1);  // and a mark
    for (const Row* row : rows) {
      const std::size_t ending = c == 0 ? row->mark.size() : 0;
      widths.back() = std::max(widths.back(), width_of(printable(row->cells[c].text)) + ending);
    }
    if (is_shown(c)) all += widths.back() + 1;
  }
  if (all > most) widths[0] -= std::min(widths[0] - std::min(widths[0], kLeastName), all - most);
  const std::size_t chosen = choices_[current_].column;
  std::size_t end = 1;  // of the chosen one
  for (std::size_t c = 0; c <= chosen; ++c) end += is_shown(c) ? widths[c] + 1 : 0;
  for (std::size_t c = 2; c < chosen && end > most; ++c) end -= std::exchange(widths[c], 0) + 1;
  return widths;
}

std::string View::header(const std::vector<std::size_t>& widths) const {
  std::string line = " ";
  const Choice& chosen = choices_[current_];
  for (std::size_t c = 0; c < widths.size(); ++c) {
    if (!is_shown(c) || widths[c] == 0) continue;
    const std::string mark = c != chosen.column ? "" : chosen.is_reversed ? "^" : "v";
    line += padded(mark + table().columns[c].title, widths[c], c >= table().first_number) + " ";
  }
  return line;
}

std::string View::text_of(const Row& row, const std::vector<std::size_t>& widths,
                          std::size_t prefix) const {
  const std::string gap = has_blocks_ ? "…" : "..";
  std::string line = row.is_bad ? "!" : " ";
  for (std::size_t c = 0; c < widths.size(); ++c) {
    if (!is_shown(c) || widths[c] == 0) continue;
    std::string cell = printable(row.cells[c].text);
    if (c == 0) {
      const std::size_t room = widths[0] - std::min(widths[0], row.mark.size());
      if (width_of(cell) > room && prefix > gap.size()) {
        cell = gap + printable(row.cells[0].text.substr(prefix));
      }
      cell = shortened(cell, room, gap) + row.mark;
    }
    line += padded(cell, widths[c], c >= table().first_number) + " ";
  }
  return line;
}

std::string View::history_of(const Row& row, std::size_t width) const {
  const std::size_t column = choices_[current_].column;
  if (column < table().first_number) return "choose a column of numbers to see a row's history";
  const auto known = histories_[current_].find(row.key);
  if (known == histories_[current_].end() || known->second[column].empty()) return "";
  const std::string title =
      fmt::format("{} of {}: ", table().columns[column].name, printable(row.cells[0].text));
  return title +
         sparkline(known->second[column], width - std::min(width, width_of(title)), has_blocks_);
}

std::string View::titles() const {
  std::string line = is_paused_ ? "PAUSED   " : "takt top ";
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const bool is_shown = i == current_;
    line += fmt::format("{}{}:{}{}", is_shown ? "[" : " ", i + 1, tables_[i].name,
                        is_shown ? "]" : " ");
  }
  return line;
}

// First those that do not run; where not all fit, how many more there are.
std::string View::states(std::size_t width) const {
  std::vector<std::string> parts;
  std::size_t not_running = 0;
  for (const Watched& container : containers_) {
    const StatisticsInterval& last = container.last;
    const std::string name = printable(container.name);
    if (container.state == Watched::State::running) {
      parts.push_back(
          fmt::format("{} (pid {}, CPU {})", name, container.pid,
                      last.seconds == 0 ? "-" : fmt::format("{:.1f} %", last.cpu_percent)));
    } else {
      parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(not_running++),
                   fmt::format("{} ({})", name, to_string(container.state)));
    }
  }
  for (std::size_t shown = parts.size(); shown > 0; --shown) {
    const auto end = parts.begin() + static_cast<std::ptrdiff_t>(shown);
    std::string line = fmt::format("{}", fmt::join(parts.begin(), end, "   "));
    if (shown < parts.size()) line += fmt::format("   and {} more", parts.size() - shown);
    if (width_of(line) <= width || shown == 1) return line;
  }
  return "";
}

std::string View::help() const {
  if (is_filtering_) return fmt::format("filter: {}_   Enter: keep it   Esc: all rows", filter_);
  const std::string filter =
      filter_.empty() ? "" : fmt::format("filter: {} (Esc: all)   ", filter_);
  return filter + "? help  q quit  1-6 Tab table  arrows row, column  r reverse  / filter  p pause";
}

void View::add_rows(std::vector<Line>& lines, std::size_t width) {
  const std::vector<const Row*> all = rows();
  const std::vector<std::size_t> columns = widths(all, width);
  const std::size_t prefix = common_prefix(all);
  const std::size_t at = place_of_selected(all), end = lines.size() + 1 + page_;
  std::size_t& first = choice().first;
  first = std::clamp(first, at + 1 - std::min(at + 1, page_), at);
  lines.push_back({header(columns), Line::Kind::header});
  for (std::size_t i = first; i < std::min(all.size(), first + page_); ++i) {
    const Row& row = *all[i];
    lines.push_back({text_of(row, columns, prefix), i == at             ? Line::Kind::selected
                                                    : !row.mark.empty() ? Line::Kind::old
                                                    : row.is_bad        ? Line::Kind::bad
                                                                        : Line::Kind::plain});
  }
  if (all.empty()) lines.push_back({filter_.empty() ? " (none)" : " (none that has the filter)"});
  lines.resize(end);
  lines.push_back({all.empty() ? "" : history_of(*all[at], width)});
}

std::vector<Line> View::lines(std::size_t width, std::size_t height) {
  page_ = height > kFixedLines ? height - kFixedLines : 1;
  std::vector<Line> lines{{titles(), Line::Kind::title}, {states(width)}, {}};
  if (shows_help_) {
    for (const char* const line : kHelp) lines.push_back({line});
    lines.resize(3 + page_ + 2);
  } else {
    add_rows(lines, width);
  }
  lines.push_back({help(), Line::Kind::help});
  const auto too_many = static_cast<std::ptrdiff_t>(lines.size() - std::min(lines.size(), height));
  const auto rows = lines.begin() + 3;
  lines.erase(rows - std::min<std::ptrdiff_t>(too_many, 2), rows);  // a low screen
  lines.resize(height);
  for (Line& line : lines) line.text = cut(std::move(line.text), width);
  return lines;
}

}  // namespace takt::tools::top
