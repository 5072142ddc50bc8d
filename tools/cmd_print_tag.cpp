// berth print-tag: markers on paper, at true size.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "berth/error.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "tag_sheet.hpp"
#include "target_sheet.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth print-tag tag36h11 7 --size 0.08 --out tag.pdf
  berth print-tag tagStandard41h12 0 --size 0.03 --grid 4x5 --out sheet.svg
  berth print-tag aruco4x4_50 3 --size 0.2 --paper a3 --out tag.pdf
  berth print-tag --bundle bundles/nested.yaml --paper a3 --out board.pdf
  berth print-tag --target targets/port.yaml --out port.pdf

--size is the side of the square that the corners span, the one to give to --size of detect and run; a ruler on the page
shows whether the printer kept to it.)";

struct PrintCommand {
  std::string family;
  std::string grid = "1x1";
  std::string paper = "a4";
  std::string out;
  std::string bundle;
  std::string target;
  int id = 0;
  double size_m = 0;
  double gap_m = 0;
};

/// "FIRSTxSECOND", both whole numbers within the limits.
bool two_numbers(const std::string& text, int least, int most, int& first, int& second) {
  int used = 0;
  const bool read = std::sscanf(text.c_str(), "%6dx%6d%n", &first, &second, &used) == 2;
  const auto within = [&](int value) { return value >= least && value <= most; };
  return read && used == static_cast<int>(text.size()) && within(first) && within(second);
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

TagSheet sheet_of(const PrintCommand& command) {
  TagSheet sheet;
  if (!command.family.empty()) sheet.family = &family(command.family);
  sheet.first_id = command.id;
  sheet.side_mm = command.size_m * 1000;
  sheet.gap_mm = command.gap_m * 1000;
  if (!two_numbers(command.grid, 1, 100, sheet.columns, sheet.rows)) {
    throw Error("--grid '" + command.grid + "': give columns x rows, whole numbers from 1 to 100, e.g. 3x4");
  }
  if (command.paper == "a3") {
    sheet.width_mm = 297;
    sheet.height_mm = 420;
  } else if (command.paper == "letter") {
    sheet.width_mm = 215.9;
    sheet.height_mm = 279.4;
  } else if (command.paper != "a4") {
    int width = 0;
    int height = 0;
    if (!two_numbers(command.paper, 20, 5000, width, height)) {
      throw Error("--paper '" + command.paper + "': give a4, a3, letter, or millimetres from 20 to 5000 like 300x200");
    }
    sheet.width_mm = width;
    sheet.height_mm = height;
  }
  return sheet;
}

int print_tag(const PrintCommand& command, Console& console) {
  const bool pdf = ends_with(command.out, ".pdf");
  if (!pdf && !ends_with(command.out, ".svg")) throw Error("--out '" + command.out + "': name a .pdf or .svg file");
  const bool from_file = !command.bundle.empty() || !command.target.empty();
  if (!from_file && (command.family.empty() || !(command.size_m > 0))) {
    throw Error(
        "print-tag needs FAMILY, ID and --size, or --bundle FILE, or --target FILE; see berth print-tag --help");
  }
  if (!command.bundle.empty() && !command.target.empty()) {
    throw Error("--bundle and --target go on pages of their own; give one of them");
  }
  if (from_file && (!command.family.empty() || command.size_m > 0 || command.grid != "1x1" || command.gap_m > 0)) {
    throw Error(std::string(command.bundle.empty() ? "--target" : "--bundle") +
                " says itself what, where and how large; leave FAMILY, ID, --size, --grid and --gap out");
  }
  const TagSheet sheet = sheet_of(command);
  if (!command.bundle.empty()) {
    const std::vector<Bundle> bundles = read_bundles(command.bundle);
    if (bundles.size() > 1) throw Error(command.bundle + ": several bundles; give a file of one");
    const PrintPage page = draw_bundle(bundles[0], sheet.width_mm, sheet.height_mm);
    write_file(command.out, "the page", pdf ? page.pdf() : page.svg());
    console.out() << fmt::format("{}: bundle {}, {} markers; print at 100 % and check the ruler\n", command.out,
                                 bundles[0].name, bundles[0].markers.size());
    return kOk;
  }
  if (!command.target.empty()) {
    const DiscTarget target = read_disc_target(command.target);
    const PrintPage page = draw_target(target, sheet.width_mm, sheet.height_mm);
    write_file(command.out, "the page", pdf ? page.pdf() : page.svg());
    console.out() << fmt::format("{}: target {}, {} discs; print at 100 % and check the ruler\n", command.out,
                                 target.name, target.discs.size());
    return kOk;
  }
  const PrintPage page = draw_sheet(sheet);
  write_file(command.out, "the page", pdf ? page.pdf() : page.svg());
  console.out() << fmt::format("{}: {} {}, {:.4g} mm; print at 100 % and check the ruler\n", command.out,
                               sheet.family->name, command.id, sheet.side_mm);
  return kOk;
}

}  // namespace

void add_print_tag(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("print-tag", "Markers and targets on paper, at true size, as PDF or SVG");
  const auto options = std::make_shared<PrintCommand>();
  command->add_option("family", options->family, "marker family")->type_name("FAMILY");
  command->add_option("id", options->id, "marker, or the first of a grid")->type_name("ID");
  command->add_option("--size", options->size_m, "side of the square that the corners span, metres")
      ->type_name("METRES")
      ->check(CLI::Range(0.001, 10.0));
  command->add_option("--bundle", options->bundle, "instead: the flat bundle of a file, every marker in its place")
      ->type_name("FILE");
  command->add_option("--target", options->target, "instead: the target of discs of a file")->type_name("FILE");
  command->add_option("--out", options->out, "a .pdf or .svg file")->type_name("FILE")->required();
  command->add_option("--grid", options->grid, "columns x rows of consecutive ids")->capture_default_str();
  command->add_option("--gap", options->gap_m, "between neighbouring squares, metres [two modules of white]")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 10.0));
  command->add_option("--paper", options->paper, "a4, a3, letter, or WIDTHxHEIGHT in mm")->capture_default_str();
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = print_tag(*options, console); });
}

}  // namespace berth::cli
