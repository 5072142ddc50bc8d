#include "eval_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "quantile.hpp"

namespace berth::cli {
namespace {

int q15(int hundredths) { return hundredths * 32768 / 100; }

double share(int part, int whole) { return whole == 0 ? 0 : 100.0 * part / whole; }

/// Decisions of each group of images, by the group's name in order.
std::string grouped(const std::string& title, const std::vector<Judged>& images, int threshold,
                    const std::function<std::string(const LabelledImage&)>& group) {
  std::map<std::string, Decisions> groups;
  for (const Judged& image : images) {
    const std::string name = group(image.truth);
    if (!name.empty()) groups[name].count(image.truth.present, image.output.score_q15 >= threshold);
  }
  std::string text =
      fmt::format("\n| {} | present | missed | % | absent | false | % |\n|---|---|---|---|---|---|---|\n", title);
  for (const auto& [name, d] : groups) {
    text += fmt::format("| {} | {} | {} | {:.2f} | {} | {} | {:.2f} |\n", name, d.present(), d.missed,
                        share(d.missed, d.present()), d.absent(), d.false_found, 100 * d.false_positive_rate());
  }
  return text;
}

std::string range_of(const LabelledImage& image) {
  if (!image.present) return "";
  for (const double edge : {1.5, 2.0, 3.0, 4.0, 6.0}) {
    if (image.depth_m < edge) return fmt::format("to {:.1f} m", edge);
  }
  return "to any further";
}

std::string hidden_of(const LabelledImage& image) {
  if (!image.present) return "";
  return image.visible >= 0.95  ? "visible 95 % and more"
         : image.visible >= 0.8 ? "visible 80 to 95 %"
                                : "visible 50 to 80 %";
}

}  // namespace

Decisions decide(const std::vector<Judged>& images, int threshold_q15) {
  Decisions decisions;
  for (const Judged& image : images) decisions.count(image.truth.present, image.output.score_q15 >= threshold_q15);
  return decisions;
}

std::vector<CurvePoint> curve_of(const std::vector<Judged>& images) {
  std::vector<Scored> scored;
  scored.reserve(images.size());
  for (const Judged& image : images) scored.push_back({image.output.score_q15, image.truth.present});
  return score_curve(std::move(scored));
}

std::string threshold_table(const std::vector<Judged>& images) {
  std::string text =
      "\n| threshold | accuracy % | errors | missed | false | true-positive rate % | false-positive rate % |\n"
      "|---|---|---|---|---|---|---|\n";
  for (int hundredths = 40; hundredths <= 80; hundredths += 5) {
    const Decisions d = decide(images, q15(hundredths));
    text +=
        fmt::format("| {:.2f} | {:.3f} | {} | {} | {} | {:.2f} | {:.2f} |\n", hundredths / 100.0, 100 * d.accuracy(),
                    d.wrong(), d.missed, d.false_found, 100 * d.true_positive_rate(), 100 * d.false_positive_rate());
  }
  return text;
}

std::string confusion_tables(const std::vector<Judged>& images, int threshold_q15) {
  return grouped("range", images, threshold_q15, range_of) + grouped("hidden", images, threshold_q15, hidden_of) +
         grouped("subject", images, threshold_q15, [](const LabelledImage& image) { return image.subject; }) +
         grouped("light", images, threshold_q15, [](const LabelledImage& image) { return image.light; });
}

std::string geometry_table(const std::vector<Judged>& images, int threshold_q15) {
  std::vector<double> size_errors;
  std::vector<double> centre_errors;
  for (const Judged& image : images) {
    const LabelledImage& truth = image.truth;
    if (!truth.present || truth.visible < 0.8 || truth.depth_m < 1.5 || truth.depth_m > 6) continue;
    if (image.output.score_q15 < threshold_q15) continue;
    size_errors.push_back(100 * std::abs(image.output.d_q16 / 65536.0 / truth.d - 1));
    centre_errors.push_back(
        100 * std::hypot(image.output.x_q16 / 65536.0 - truth.x, image.output.y_q16 / 65536.0 - truth.y) / truth.d);
  }
  return fmt::format(
      "\n| of {} targets found, 80 % visible, 1.5 to 6 m | median % | p68 % | p90 % |\n|---|---|---|---|\n"
      "| error of d, of d | {:.2f} | {:.2f} | {:.2f} |\n| error of the centre, of d | {:.2f} | {:.2f} | {:.2f} |\n",
      size_errors.size(), quantile(size_errors, 0.5), quantile(size_errors, 0.68), quantile(size_errors, 0.9),
      quantile(centre_errors, 0.5), quantile(centre_errors, 0.68), quantile(centre_errors, 0.9));
}

double overlap(const Square& a, const Square& b) {
  const auto common = [&](double at_a, double at_b) {
    return std::max(0.0,
                    std::min(at_a + a.side / 2, at_b + b.side / 2) - std::max(at_a - a.side / 2, at_b - b.side / 2));
  };
  const double both = common(a.x, b.x) * common(a.y, b.y);
  return both > 0 ? both / (a.side * a.side + b.side * b.side - both) : 0;
}

std::string range_table(const std::vector<Judged>& images, int threshold_q15) {
  struct Group {
    int targets = 0;
    int overlapping = 0;
    std::vector<double> errors;
  };
  std::map<std::string, Group> groups;
  for (const Judged& image : images) {
    const LabelledImage& truth = image.truth;
    if (!truth.present) continue;
    Group& group = groups[range_of(truth)];
    ++group.targets;
    if (image.output.score_q15 < threshold_q15) continue;
    const Square said = {image.output.x_q16 / 65536.0, image.output.y_q16 / 65536.0, image.output.d_q16 / 65536.0};
    if (overlap(said, {truth.x, truth.y, truth.d}) >= 0.5) ++group.overlapping;
    // Range is f * D / d with f and D known, so that d alone makes its error.
    if (truth.visible >= 0.8) group.errors.push_back(100 * std::abs(truth.d / said.side - 1));
  }
  std::string text =
      "\n| range | targets | found, IoU 0.5 and more | % | found, 80 % visible | range error p50 % | p90 % |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const auto& [name, group] : groups) {
    text += fmt::format("| {} | {} | {} | {:.2f} | {} | {:.2f} | {:.2f} |\n", name, group.targets, group.overlapping,
                        share(group.overlapping, group.targets), group.errors.size(), quantile(group.errors, 0.5),
                        quantile(group.errors, 0.9));
  }
  return text;
}

std::string rates_table(const std::vector<Judged>& images, const std::vector<Rival>& rivals) {
  std::string text = "\n| threshold | network: true positives % | false positives % |";
  for (const Rival& rival : rivals) text += fmt::format(" {}: true positives % | false positives % |", rival.name);
  text += "\n|---|---|---|";
  for (std::size_t i = 0; i < rivals.size(); ++i) text += "---|---|";
  const auto rates = [](const Decisions& d) {
    return fmt::format(" {:.2f} | {:.2f} |", 100 * d.true_positive_rate(), 100 * d.false_positive_rate());
  };
  for (std::size_t i = 0; i < kTableThresholds.size(); ++i) {
    text += fmt::format("\n| {:.2f} |", kTableThresholds[i] / 100.0) + rates(decide(images, q15(kTableThresholds[i])));
    for (const Rival& rival : rivals) text += rates(rival.decisions[i]);
  }
  return text + "\n";
}

}  // namespace berth::cli
