#pragma once

#include <string>
#include <vector>

#include "navigation/labelled_set.hpp"
#include "navigation/network_output.hpp"

namespace berth::cli {

/// An image of a set and what the network said of it.
struct Judged {
  LabelledImage truth;
  NetworkOutput output;
};

/// Decisions at a threshold, Q15: found where the score is as high or higher.
struct Decisions {
  int right_found = 0;
  int missed = 0;
  int false_found = 0;
  int right_absent = 0;

  void count(const Judged& image, int threshold_q15);
  int present() const { return right_found + missed; }
  int absent() const { return false_found + right_absent; }
  int all() const { return present() + absent(); }
  int wrong() const { return missed + false_found; }
};
Decisions decide(const std::vector<Judged>& images, int threshold_q15);

/// Markdown: decisions at 0.40 to 0.80 (the paper's Table 1).
std::string threshold_table(const std::vector<Judged>& images);
/// Markdown: misses by range and by what is hidden, false positives by subject, all by light.
std::string confusion_tables(const std::vector<Judged>& images, int threshold_q15);
/// Markdown: errors of d (so of the range) and of the centre, of the targets found, four fifths visible, 1.5 to 6 m
/// away.
std::string geometry_table(const std::vector<Judged>& images, int threshold_q15);

}  // namespace berth::cli
