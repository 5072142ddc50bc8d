#pragma once

#include <array>
#include <string>
#include <vector>

#include "navigation/labelled_set.hpp"
#include "navigation/network_output.hpp"
#include "score_curve.hpp"

namespace berth::cli {

/// An image of a set and what the network said of it.
struct Judged {
  LabelledImage truth;
  NetworkOutput output;
};

/// Decisions at a threshold, Q15: found where the score is as high or higher.
Decisions decide(const std::vector<Judged>& images, int threshold_q15);
/// The same at every threshold.
std::vector<CurvePoint> curve_of(const std::vector<Judged>& images);

/// The thresholds of the paper's Table 1, in hundredths.
constexpr std::array<int, 8> kTableThresholds = {45, 50, 55, 60, 65, 70, 75, 80};

/// Markdown: decisions at 0.40 to 0.80.
std::string threshold_table(const std::vector<Judged>& images);
/// Markdown: misses by range and by what is hidden, false positives by subject, all by light.
std::string confusion_tables(const std::vector<Judged>& images, int threshold_q15);
/// Markdown: errors of d (so of the range) and of the centre, of the targets found, four fifths visible, 1.5 to 6 m
/// away.
std::string geometry_table(const std::vector<Judged>& images, int threshold_q15);

/// A square by its centre and side, px: what a network and a label say of a target, the side its circumscribed
/// diameter.
struct Square {
  double x = 0;
  double y = 0;
  double side = 0;
};
/// Intersection over union, clipped by no image's edge; 0 for an empty square.
double overlap(const Square& a, const Square& b);
/// Markdown, by range: targets found with an overlap of 0.5 or more, of all targets; error of the range, of the targets
/// found that are four fifths visible.
std::string range_table(const std::vector<Judged>& images, int threshold_q15);

/// A method that Table 1 sets beside the network, with its decisions at each of kTableThresholds.
struct Rival {
  std::string name;
  std::array<Decisions, kTableThresholds.size()> decisions;
};
/// Markdown: true- and false-positive rates of the network and of others at kTableThresholds (the paper's Table 1).
std::string rates_table(const std::vector<Judged>& images, const std::vector<Rival>& rivals);

}  // namespace berth::cli
