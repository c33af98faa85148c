// SPDX-License-Identifier: Apache-2.0
#include "table.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "takt/base/printable.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {

void Table::add(std::vector<std::string> row) {
  for (std::string& cell : row) cell = printable(cell);
  rows_.push_back(std::move(row));
}

void Table::print(const std::string& title) const {
  if (rows_.size() < 2) return;
  std::vector<std::size_t> widths(rows_[0].size());
  std::vector<bool> is_number(rows_[0].size(), true);
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    for (std::size_t column = 0; column < rows_[row].size(); ++column) {
      const std::string& cell = rows_[row][column];
      widths[column] = std::max(widths[column], cell.size());
      if (row > 0 && !cell.empty() && std::isdigit(static_cast<unsigned char>(cell[0])) == 0 &&
          cell[0] != '-' && cell[0] != '.') {
        is_number[column] = false;
      }
    }
  }
  rt::print("\n{}\n", title);
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t column = 0; column < row.size(); ++column) {
      if (column > 0) line += "  ";
      line += is_number[column] ? fmt::format("{:>{}}", row[column], widths[column])
                                : fmt::format("{:<{}}", row[column], widths[column]);
    }
    rt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

std::string microseconds(Nanoseconds duration) {
  const double us = static_cast<double>(duration.count()) / 1e3;
  return us < 10    ? fmt::format("{:.2f}", us)
         : us < 100 ? fmt::format("{:.1f}", us)
                    : fmt::format("{:.0f}", us);
}

std::string milliseconds(Nanoseconds duration) {
  return fmt::format("{:.3f}", static_cast<double>(duration.count()) / 1e6);
}

}  // namespace takt::tools
