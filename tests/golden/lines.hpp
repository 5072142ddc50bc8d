#pragma once

#include <string>
#include <vector>

#include "berth/types.hpp"

namespace berth::golden {

/// What a frame gave, one thing a line: a name, ": ", and values that tell every bit, between blanks.
class Lines {
 public:
  /// Doubles by their shortest decimals that read back to the same bits.
  void numbers(const std::string& name, const double* values, std::size_t count);
  /// One number for many: FNV-1a over their bits.
  void digest(const std::string& name, const double* values, std::size_t count);
  void digest(const std::string& name, u64 digest);
  void integers(const std::string& name, const std::vector<long long>& values);

  const std::vector<std::string>& all() const { return lines_; }

 private:
  std::vector<std::string> lines_;
};

/// The lines of a file, without comments. Throws Error naming the file where it cannot be read.
std::vector<std::string> read_lines(const std::string& path);

/// The first thing that differs: its name, which value, what it is in either. Empty where all are equal.
std::string first_difference(const std::vector<std::string>& expected, const std::vector<std::string>& found);

}  // namespace berth::golden
