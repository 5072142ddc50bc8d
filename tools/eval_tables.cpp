#include "eval_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "quantile.hpp"

namespace berth::cli {
namespace {

double share(int part, int whole) { return whole == 0 ? 0 : 100.0 * part / whole; }

/// Decisions of each group of images, by the group's name in order.
std::string grouped(const std::string& title, const std::vector<Judged>& images, int threshold,
                    const std::function<std::string(const LabelledImage&)>& group) {
  std::map<std::string, Decisions> groups;
  for (const Judged& image : images) {
    const std::string name = group(image.truth);
    if (!name.empty()) groups[name].count(image, threshold);
  }
  std::string text =
      fmt::format("\n| {} | present | missed | % | absent | false | % |\n|---|---|---|---|---|---|---|\n", title);
  for (const auto& [name, d] : groups) {
    text += fmt::format("| {} | {} | {} | {:.2f} | {} | {} | {:.2f} |\n", name, d.present(), d.missed,
                        share(d.missed, d.present()), d.absent(), d.false_found, share(d.false_found, d.absent()));
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

void Decisions::count(const Judged& image, int threshold_q15) {
  const bool found = image.output.score_q15 >= threshold_q15;
  (image.truth.present ? found ? right_found : missed : found ? false_found : right_absent)++;
}

Decisions decide(const std::vector<Judged>& images, int threshold_q15) {
  Decisions decisions;
  for (const Judged& image : images) decisions.count(image, threshold_q15);
  return decisions;
}

std::string threshold_table(const std::vector<Judged>& images) {
  std::string text =
      "\n| threshold | accuracy % | errors | missed | false | true-positive rate % | false-positive rate % |\n"
      "|---|---|---|---|---|---|---|\n";
  for (int hundredths = 40; hundredths <= 80; hundredths += 5) {
    const Decisions d = decide(images, hundredths * 32768 / 100);
    text += fmt::format("| {:.2f} | {:.3f} | {} | {} | {} | {:.2f} | {:.2f} |\n", hundredths / 100.0,
                        share(d.all() - d.wrong(), d.all()), d.wrong(), d.missed, d.false_found,
                        share(d.right_found, d.present()), share(d.false_found, d.absent()));
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

}  // namespace berth::cli
