#pragma once

#include <string>
#include <vector>

namespace berth::cli {

/// A table of a benchmark: the first column is names, the others are figures.
struct BenchTable {
  std::string title;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
  /// What must be known to read it; may be empty.
  std::string note;
};

/// Columns lined up for a terminal.
std::string aligned(const BenchTable& table);
/// The same as Markdown.
std::string markdown(const BenchTable& table);

}  // namespace berth::cli
