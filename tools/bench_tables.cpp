#include "bench_tables.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace berth::cli {
namespace {

/// Characters on the screen of UTF-8 text.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u; }));
}

}  // namespace

std::string aligned(const BenchTable& table) {
  std::vector<std::size_t> widths;
  for (std::size_t column = 0; column < table.head.size(); ++column) {
    std::size_t width = width_of(table.head[column]);
    for (const auto& row : table.rows) width = std::max(width, width_of(row[column]));
    widths.push_back(width);
  }
  const auto line = [&widths](const std::vector<std::string>& row) {
    std::string text = " ";
    for (std::size_t column = 0; column < row.size(); ++column) {
      const std::string room(widths[column] - width_of(row[column]), ' ');
      text += column == 0 ? " " + row[column] + room : "  " + room + row[column];
    }
    return text + "\n";
  };
  std::string text = "\n" + table.title + "\n" + line(table.head);
  for (const auto& row : table.rows) text += line(row);
  return table.note.empty() ? text : text + "  " + table.note + "\n";
}

std::string markdown(const BenchTable& table) {
  const auto line = [](const std::vector<std::string>& row) { return fmt::format("| {} |\n", fmt::join(row, " | ")); };
  std::string text = "\n**" + table.title + "**\n\n" + line(table.head) + "|---|";
  for (std::size_t column = 1; column < table.head.size(); ++column) text += "---:|";
  text += "\n";
  for (const auto& row : table.rows) text += line(row);
  return table.note.empty() ? text : text + "\n" + table.note + "\n";
}

}  // namespace berth::cli
