// What `takt top` shows: tables of threads, executors, callbacks, chains, topics and deviations, as
// lines.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TOP_VIEW_HPP_
#define TAKT_TOOLS_TAKT_TOP_VIEW_HPP_

#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "top/watch.hpp"

namespace takt::tools::top {

struct Cell {
  std::string text;  // of a stranger, perhaps: it is made printable where it is shown
  double value = 0;  // by which a column of numbers is sorted
  bool is_of_interval = false;
};

struct Column {
  Column(const char* title_of, const char* name_of = nullptr)
      : title(title_of), name(name_of != nullptr ? name_of : title_of) {}
  std::string title;
  std::string name;  // in full, where the title relies on the column beside it
};

struct Row {
  std::string key;          // tells it from all others of its table
  std::vector<Cell> cells;  // the first one is the row's name, the second its container
  bool is_bad = false;      // deadlines were missed, or messages dropped, in the last interval
  bool is_new = true;       // its container answered in this interval
  std::string mark = {};    // why the cells are old: its container does not run
};

struct Table {
  std::string name;  // "callbacks"
  std::vector<Column> columns;
  std::size_t first_number = 0;  // the columns from here on are numbers
  std::vector<Row> rows;
};

/// The six tables, in the order of the keys 1 to 6.
std::vector<Table> tables_of(const std::vector<Watched>& containers);

/// The last values as characters that rise and fall, one each, scaled from their smallest to their
/// largest.
std::string sparkline(const std::deque<double>& values, std::size_t width, bool has_blocks);

/// A key that was pressed: a character, or one of these.
enum Key : int {
  kUp = -100,
  kDown,
  kPageUp,
  kPageDown,
  kHome,
  kEnd,
  kLeft,
  kRight,
  kErase,
  kEscape
};

struct Line {
  enum class Kind { plain, title, header, selected, bad, old, help };
  std::string text;
  Kind kind = Kind::plain;
};

/// What the user has chosen to see. Thread safety: none.
class View {
 public:
  /// `has_blocks`: the terminal shows UTF-8.
  explicit View(bool has_blocks);

  /// An interval has passed. While paused, only its values are kept for the history.
  void show(const std::vector<Watched>& containers);
  /// Returns false if the user wants to end.
  bool press(int key);
  bool is_paused() const noexcept { return is_paused_; }
  /// Exactly `height` lines of at most `width` characters.
  std::vector<Line> lines(std::size_t width, std::size_t height);

 private:
  /// How one of the tables is seen.
  struct Choice {
    std::size_t column = 0;  // sorted by; its history is shown
    bool is_reversed = false;
    std::string selected;   // the row's key
    std::size_t first = 0;  // row on the screen
  };
  using History = std::map<std::string, std::vector<std::deque<double>>>;  // by row and column

  void remember();
  const Table& table() const { return tables_[current_]; }
  Choice& choice() { return choices_[current_]; }
  std::vector<const Row*> rows() const;
  std::size_t place_of_selected(const std::vector<const Row*>& rows) const;
  void move(std::ptrdiff_t by);
  bool press_in_filter(int key);
  bool is_shown(std::size_t column) const noexcept { return column != 1 || containers_.size() > 1; }
  void choose(std::ptrdiff_t by);
  std::vector<std::size_t> widths(const std::vector<const Row*>& rows, std::size_t most) const;
  std::string header(const std::vector<std::size_t>& widths) const;
  std::string text_of(const Row& row, const std::vector<std::size_t>& widths,
                      std::size_t prefix) const;
  void add_rows(std::vector<Line>& lines, std::size_t width);
  std::string history_of(const Row& row, std::size_t width) const;
  std::string titles() const;
  std::string states(std::size_t width) const;
  std::string help() const;

  const bool has_blocks_;
  std::vector<Watched> containers_;
  std::vector<Table> newest_, tables_;  // what is shown is older while paused
  std::vector<Choice> choices_;         // of each table
  std::vector<History> histories_;
  std::size_t current_ = 2;  // callbacks
  std::size_t page_ = 1;     // rows that fit on the screen
  bool is_paused_ = false, is_filtering_ = false, shows_help_ = false;
  std::string filter_;
};

}  // namespace takt::tools::top

#endif  // TAKT_TOOLS_TAKT_TOP_VIEW_HPP_
