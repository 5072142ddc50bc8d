// berth calibrate: a camera's lens from images of a board.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>

#include "berth/error.hpp"
#include "calibration/board_finder.hpp"
#include "calibration_show.hpp"
#include "camera/bad_input.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "interrupt.hpp"
#include "live_view.hpp"
#include "output_file.hpp"
#include "source_arguments.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth calibrate --board aprilgrid --grid 5x7 --size 0.03 --out camera.yaml images/
  berth calibrate --board chessboard --grid 9x7 --size 0.025 --out camera.yaml --plot residuals.svg *.png
  berth calibrate --board charuco --grid 8x6 --size 0.04 --marker 0.03 --family aruco5x5_100 --out camera.yaml x/
  berth calibrate --source video:board.mp4 --board aprilgrid --grid 5x7 --size 0.03 --model equidistant --out fish.yaml
  berth calibrate --source sim:scenarios/calibration.toml --board aprilgrid --grid 6x6 --size 0.03 --out sim.yaml

Print an aprilgrid with print-tag --grid. --size is its markers' side; of the others the side of a square.)";

struct CalibrateCommand {
  std::vector<std::string> images;
  std::string source;
  BoardKind kind = BoardKind::aprilgrid;
  std::string grid;
  std::string size;
  std::string marker;
  std::string gap;
  std::string family;
  int first_id = 0;
  LensModel lens = LensModel::radial_tangential;
  std::size_t most_views = 50;
  std::string out;
  std::string name = "camera";
  std::string plot;
  std::string json;
  EngineOptions engine;
};

Board board_of(const CalibrateCommand& command) {
  Board board;
  board.kind = command.kind;
  int used = 0;
  if (std::sscanf(command.grid.c_str(), "%4dx%4d%n", &board.columns, &board.rows, &used) != 2 ||
      used != static_cast<int>(command.grid.size())) {
    throw bad_field("command line", "--grid", "'" + command.grid + "'",
                    "give columns x rows of squares, or of an aprilgrid's markers, e.g. 9x7");
  }
  const double size_m = parse_metres("--size", command.size);
  const bool charuco = board.kind == BoardKind::charuco, aprilgrid = board.kind == BoardKind::aprilgrid;
  const auto only_for = [](const char* option, bool given, const char* kind) {
    if (given) throw bad_field("command line", option, "given", std::string("leave it out: only ") + kind + " has it");
  };
  only_for("--marker", !charuco && !command.marker.empty(), "a charuco");
  only_for("--gap", !aprilgrid && !command.gap.empty(), "an aprilgrid");
  board.pitch_m = size_m;
  if (board.kind != BoardKind::chessboard) {
    board.family = &family(!command.family.empty() ? command.family : charuco ? "aruco4x4_50" : "tag36h11");
    board.first_id = command.first_id;
  }
  if (charuco) {
    if (command.marker.empty()) {
      throw bad_field("command line", "--marker", "missing", "give the side of a marker's border square, metres");
    }
    board.marker_m = parse_metres("--marker", command.marker);
  }
  if (aprilgrid) {
    board.marker_m = size_m;
    board.pitch_m =
        command.gap.empty() ? default_pitch_m(*board.family, size_m) : size_m + parse_metres("--gap", command.gap);
  }
  board.check();
  return board;
}

/// Looks for the board in every frame, with the coverage as it grows.
class Gathering {
 public:
  Gathering(const CalibrateCommand& command, const Board& board, Console& console)
      : command_(command), board_(board), console_(console), backends_(open_chosen_backends(command.engine)) {}

  /// The views, and none where no frame came. Throws Error where frames have different sizes.
  const ViewSet& run(Source& source) {
    LiveView live(console_.out(), console_.out_is_terminal(), source.size());
    const InterruptWatch interrupt;
    while (!full_) {
      const std::optional<SourceFrame> frame = next_readable(source, console_, interrupt);
      if (!frame) break;
      ++frames_;
      const char* verdict = look_at(*frame);
      live.show(frames_, coverage_bar(*set_), coverage_map(*set_),
                fmt::format("{} views; {}: {}", set_->views().size(), frame->label, verdict));
    }
    live.finish();
    if (!set_) throw Error("no image could be read; give images of the board");
    console_.out() << fmt::format(
        "{} frames: {} views taken, {} without the board, {} blurred, {} like an earlier one\n", frames_,
        set_->views().size(), without_, set_->blurred(), repeated_);
    return *set_;
  }

 private:
  const char* look_at(const SourceFrame& frame) {
    const int width = frame.image.width(), height = frame.image.height();
    if (!set_) {
      set_.emplace(width, height, command_.most_views);
      finder_.emplace(board_, *backends_.backends.front(), width, height);
    }
    if (width != set_->width() || height != set_->height()) {
      throw Error(
          fmt::format("{}: field 'size' is {}x{}, but the images before are {}x{}; give images of one camera, as "
                      "it took them",
                      frame.label, width, height, set_->width(), set_->height()));
    }
    std::optional<BoardView> view = finder_->find(frame.image.view());
    if (!view) {
      ++without_;
      return "no board";
    }
    view->label = frame.label;
    switch (set_->add(std::move(*view))) {
      case ViewSet::Verdict::taken:
        return "taken";
      case ViewSet::Verdict::blurred:
        return "blurred";
      case ViewSet::Verdict::repeated:
        ++repeated_;
        return "like an earlier one";
      case ViewSet::Verdict::full:
        full_ = true;
        break;
    }
    return "enough views";
  }

  const CalibrateCommand& command_;
  const Board& board_;
  Console& console_;
  EngineBackends backends_;
  std::optional<ViewSet> set_;
  std::optional<BoardFinder> finder_;
  std::size_t frames_ = 0;
  int without_ = 0, repeated_ = 0;
  bool full_ = false;
};

int refuse(const std::vector<std::string>& objections, Console& console) {
  for (const std::string& objection : objections) console.note("refused: " + objection);
  return kNoResult;
}

int run_calibrate(const CalibrateCommand& command, Console& console) {
  const Board board = board_of(command);
  const std::unique_ptr<Source> source = open_arguments(command.images, command.source);
  Gathering gathering(command, board, console);
  const ViewSet& set = gathering.run(*source);
  console.out() << "coverage " << coverage_bar(set) << '\n';
  const std::vector<std::string> objections = set.objections();
  if (!objections.empty()) return refuse(objections, console);

  const Calibration result = calibrate(board, set, command.lens);
  console.out() << calibration_text(result, set);
  if (!command.plot.empty()) write_file(command.plot, "the plot", residual_svg(result, set));
  if (!command.json.empty()) {
    write_file(command.json, "the result", calibration_json(result, set, board).dump(2) + "\n");
  }
  // The plot shows what is wrong, so it is there all the same.
  const std::vector<std::string> doubts = result.objections(set);
  if (!doubts.empty()) return refuse(doubts, console);
  write_camera_info(command.out, result.camera, command.name, deviation_of(result));
  console.out() << command.out << ": for images of " << set.width() << "x" << set.height() << '\n';
  return kOk;
}

}  // namespace

void add_calibrate(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("calibrate", "A camera's lens from images of a board, as camera_info YAML");
  const auto options = std::make_shared<CalibrateCommand>();
  command->add_option("IMAGE", options->images, "PNG, JPEG or PNM files, or folders of them");
  command
      ->add_option(
          "--source", options->source,
          "sim:FILE, dir:DIR, video:FILE, mcap:FILE, v4l2:CAMERA, aravis:CAMERA or gst:PIPELINE instead of images")
      ->type_name("SOURCE");
  command->add_option("--board", options->kind, "aprilgrid, chessboard or charuco")
      ->transform(CLI::CheckedTransformer(std::map<std::string, BoardKind>{
          {"aprilgrid", BoardKind::aprilgrid}, {"chessboard", BoardKind::chessboard}, {"charuco", BoardKind::charuco}}))
      ->type_name("KIND")
      ->required();
  command->add_option("--grid", options->grid, "columns x rows of squares, or of an aprilgrid's markers")
      ->type_name("CxR")
      ->required();
  command->add_option("--size", options->size, "side of a square, or of an aprilgrid's markers, metres")
      ->type_name("METRES")
      ->required();
  command->add_option("--out", options->out, "the camera file to write")->type_name("FILE")->required();
  command->add_option("--marker", options->marker, "charuco: side of its markers, metres")->type_name("METRES");
  command->add_option("--gap", options->gap, "aprilgrid: between markers, metres [that of print-tag]")
      ->type_name("METRES");
  command->add_option("--family", options->family, "of the markers [tag36h11; charuco: aruco4x4_50]")
      ->type_name("NAME");
  command->add_option("--first-id", options->first_id, "of the upper left marker")
      ->type_name("ID")
      ->capture_default_str();
  command->add_option("--model", options->lens, "plumb_bob, or equidistant for a fisheye [plumb_bob]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, LensModel>{{"plumb_bob", LensModel::radial_tangential},
                                                                           {"equidistant", LensModel::equidistant}}))
      ->type_name("MODEL");
  command->add_option("--views", options->most_views, "take so many at most")
      ->type_name("N")
      ->check(CLI::Range(10, 1000))
      ->capture_default_str();
  command->add_option("--plot", options->plot, "drawing of the residuals")->type_name("FILE.svg");
  command->add_option("--json", options->json, "the result with every view")->type_name("FILE");
  command->add_option("--name", options->name, "camera_name in the file")->type_name("NAME")->capture_default_str();
  add_backend_options(*command, options->engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_calibrate(*options, console); });
}

}  // namespace berth::cli
