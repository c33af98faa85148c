// The page that `takt compare --report` writes.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "comparison.hpp"
#include "table.hpp"
#include "takt/base/error.hpp"

namespace takt::tools {
namespace {

constexpr double kPlotLeft = 220, kPlotWidth = 640, kRowHeight = 26;
constexpr double kLowest_us = 0.1, kDecades = 6;  // 0.1 µs to 100 ms

std::string escaped(const std::string& text) {
  std::string result;
  for (const char character : text) {
    if (character == '<') {
      result += "&lt;";
    } else if (character == '&') {
      result += "&amp;";
    } else {
      result += character;
    }
  }
  return result;
}

double x_of(Nanoseconds latency) {
  const double us = std::max(static_cast<double>(latency.count()) / 1e3, kLowest_us);
  return kPlotLeft + kPlotWidth * std::min(std::log10(us / kLowest_us) / kDecades, 1.0);
}

/// One line a row: a bar from p50 to p99, with ticks at p90, p99.9 and the maximum.
std::string plot(const std::vector<Comparison>& rows) {
  const double height = kRowHeight * static_cast<double>(rows.size()) + 40;
  std::string svg = fmt::format("<svg viewBox='0 0 900 {0}' width='900' height='{0}'>", height);
  for (int decade = 0; decade <= static_cast<int>(kDecades); ++decade) {
    const double x = kPlotLeft + kPlotWidth * decade / kDecades;
    svg += fmt::format("<line x1='{0}' x2='{0}' y1='20' y2='{1}' stroke='#ddd'/>", x, height);
    svg += fmt::format("<text x='{}' y='14' text-anchor='middle'>{:g} µs</text>", x,
                       kLowest_us * std::pow(10, decade));
  }
  double y = 36;
  for (const Comparison& row : rows) {
    const auto x = [&row](double fraction) { return x_of(row.latency.percentile(fraction)); };
    svg += fmt::format("<text x='{}' y='{}' text-anchor='end'>{} {}</text>", kPlotLeft - 10, y + 5,
                       escaped(row.executor), escaped(row.scheduler));
    svg += fmt::format("<line x1='{}' x2='{}' y1='{}' y2='{}' stroke='#999'/>", x(0.99), x(1), y, y);
    svg += fmt::format("<rect x='{}' y='{}' width='{}' height='12' fill='#4a7ab5'/>", x(0.5), y - 6,
                       std::max(x(0.99) - x(0.5), 1.0));
    for (const double fraction : {0.9, 0.999, 1.0}) {
      svg += fmt::format("<line x1='{0}' x2='{0}' y1='{1}' y2='{2}' stroke='#c33'/>", x(fraction),
                         y - 8, y + 8);
    }
    y += kRowHeight;
  }
  return svg + "</svg>";
}

std::string table(const std::vector<Comparison>& rows) {
  std::string html =
      "<table><tr><th>executor<th>scheduler<th>received<th>lost<th>dropped<th>late<th>too late"
      "<th>p50<th>p90<th>p99<th>p99.9<th>max<th>cpu %<th>wakeups/s<th>PSS MB</tr>\n";
  for (const Comparison& row : rows) {
    html += fmt::format("<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}", escaped(row.executor),
                        escaped(row.scheduler), row.received, row.lost, row.dropped, row.late,
                        row.too_late);
    for (const double fraction : {0.5, 0.9, 0.99, 0.999, 1.0}) {
      html += fmt::format("<td>{}", microseconds(row.latency.percentile(fraction)));
    }
    html += fmt::format("<td>{:.2f}<td>{:.0f}<td>{:.1f}</tr>\n", median(row.cpu_percent),
                        median(row.wakeups_per_s), median(row.pss_mb));
  }
  return html + "</table>";
}

}  // namespace

void write_report(const std::vector<Comparison>& rows, const std::string& path) {
  std::ofstream file(path);
  file << "<!doctype html><meta charset='utf-8'><title>takt compare</title><style>"
          "body{font:14px sans-serif;margin:2em;max-width:1100px}table{border-collapse:collapse}"
          "td,th{padding:3px 9px;text-align:right;border-bottom:1px solid #ddd}"
          "td:nth-child(-n+2),th:nth-child(-n+2){text-align:left}text{font:12px sans-serif}</style>";
  for (std::size_t first = 0; first < rows.size();) {
    std::vector<Comparison> of_file;
    const std::string name = rows[first].file;
    for (; first < rows.size() && rows[first].file == name; ++first) of_file.push_back(rows[first]);
    file << "<h1>" << escaped(name) << "</h1><p>Latency of subscriptions, publish → callback: bar "
         << "from p50 to p99, ticks at p90, p99.9 and the maximum.</p>" << plot(of_file)
         << "<p>Latencies in µs.</p>" << table(of_file);
  }
  file.close();
  if (!file) throw Error("the report could not be written", "choose a place that can be", path);
}

}  // namespace takt::tools
