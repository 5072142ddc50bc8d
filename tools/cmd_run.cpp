// berth run: markers in a stream of frames.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "berth/error.hpp"
#include "camera/sources.hpp"
#include "commands.hpp"
#include "recording_setup.hpp"
#include "run_options.hpp"
#include "service_notify.hpp"
#include "systematic_show.hpp"

namespace berth::cli {
namespace {

/// Usual time between known answers, s: one takes as long as a frame.
constexpr double kKnownAnswerS = 10;

constexpr const char* kExamples = R"(Examples:
  berth run --source sim:scenarios/approach.toml
  berth run --source video:approach.mp4 --camera cam.yaml --size 0.08 --json log.jsonl
  berth run --config berth.toml                  options from a file: berth config --explain
  berth run --source dir:recording/ --json - | jq .detections
  berth run --source sim:scenarios/approach.toml --filter --json log.jsonl
  berth run --source sim:scenarios/track.toml --track --json log.jsonl
  berth run --source sim:scenarios/approach.toml --bundle bundles/approach.yaml
  berth run --source sim:scenarios/port.toml --target targets/port.yaml
  berth run --source sim:scenarios/approach.toml --digests --json a.jsonl --backend opencl
  berth run --source v4l2:video0,width=640,height=480,fps=120 --camera cam.yaml --size 0.08 --filter
  berth run --source v4l2:video0,width=640,height=480,fps=120 --stream --track    at its own pace
  berth run --source aravis:SERIAL,width=640,height=480,fps=300,exposure_us=500,packet_size=8000 --stream
  berth run --source 'gst:v4l2src ! jpegdec ! videoconvert' --stream     whatever GStreamer reaches
  berth run --source dir:recording/ --lockstep simd,opencl       every stage of every frame compared
  berth run --source sim:scenarios/approach.toml --record approach.mcap    for berth replay, Foxglove, rosbag2
  berth run --source mcap:approach.mcap --corners photometric              a recording, searched otherwise
  berth run --source sim:scenarios/approach.toml --fps 300 --minutes 30    as a camera would: latency, drops
  berth run --source v4l2:video0 --camera cam.yaml --size 0.08 --ros --ros-namespace robot1    to ROS 2 nodes
  berth run --source sim:scenarios/approach.toml --fps 30 --minutes 5 --filter --view    watched in a browser
  berth run --source sim:scenarios/approach.toml --report approach.html    the run as one page

Ctrl-C ends the stream cleanly, with its summary.)";

void add_record_options(CLI::App& command, RecordOptions& record) {
  CLI::Option* file = command
                          .add_option("--record", record.file,
                                      "record frames, poses, detections, health and digests in an MCAP file "
                                      "(docs/recording.md)")
                          ->type_name("FILE");
  command
      .add_option("--record-images", record.pictures,
                  "how frames are kept: raw, png (a quarter smaller, some ms a frame), or none (no replay) [raw]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, RecordPictures>{
          {"raw", RecordPictures::raw}, {"png", RecordPictures::png}, {"none", RecordPictures::none}}))
      ->type_name("HOW")
      ->needs(file);
  command
      .add_option("--record-queue", record.queue,
                  "frames that may wait for the disk; those beyond are dropped and counted, where frames do not wait")
      ->type_name("N")
      ->needs(file)
      ->capture_default_str();
}

/// Whether a source is the file that it is to be recorded in.
bool is_same_file(const std::string& source, const std::string& file) {
  std::error_code ignored;
  const std::string path = source.substr(source.find(':') + 1);
  return std::filesystem::equivalent(path, file, ignored) || std::filesystem::equivalent(source, file, ignored);
}

}  // namespace

void add_run(CLI::App& app, Console& console, int& exit_code, const RunPart& part) {
  CLI::App* command = app.add_subcommand("run", "Find markers in a stream: simulation, folder, image, video or camera");
  const auto options = std::make_shared<RunOptions>();
  command
      ->add_option("--source", options->source,
                   "sim:FILE (scenario), dir:DIR, file:IMAGE, video:FILE, mcap:FILE (a recording), v4l2:CAMERA, "
                   "aravis:CAMERA or gst:PIPELINE (docs/cameras.md), or a path that tells")
      ->type_name("SOURCE")
      ->required();
  // Read before the command line is parsed: run_config.hpp.
  command->add_option("--config", options->config, "TOML file of these options; berth config --explain has its keys")
      ->type_name("FILE");
  command->add_option("--json", options->stream.log, "log: one JSON line a frame; - for standard output")
      ->type_name("FILE");
  command->add_option("--svg", options->stream.svg, "drawing of the trajectory")->type_name("FILE");
  command->add_flag("--digests", options->stream.digests, "log a digest of every stage's output (slow)");
  command->add_flag("--filter", options->stream.filter,
                    "poses filtered over time, with velocities, beside the raw ones");
  CLI::Option* track =
      command->add_flag("--track", options->stream.track, "search only around the markers held, with the same bits");
  command
      ->add_option("--full-every", options->stream.full_every,
                   "with --track: the whole frame after so many in windows at the latest")
      ->type_name("N")
      ->needs(track)
      ->check(CLI::Range(1, 1000000))
      ->default_str(std::to_string(TrackerConfig().full_every));
  command->add_option("--max-frames", options->stream.max_frames, "end after so many frames, 0 for all")
      ->type_name("N")
      ->capture_default_str();
  CLI::Option* known_answer =
      command
          ->add_option("--known-answer", options->stream.known_answer_s,
                       "at start and every so many seconds a picture with a known answer, memory checked all the "
                       "while; what fails gives way to --fallback (docs/reliability.md); 0 for none [10 at a camera's "
                       "pace, else none]")
          ->type_name("SECONDS")
          ->check(CLI::Range(0.0, 1e6));
  command
      ->add_option("--fail-back", options->stream.fail_back_s,
                   "with --known-answer: a backend that was left is opened anew after so many seconds, then less and "
                   "less often, and gone back to once it gives right answers; 0 for never")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  CLI::Option* hang_after =
      command
          ->add_option("--hang-after", options->stream.hang_ms,
                       "a device that a frame is waited for longer than this gives way to --fallback as one that is "
                       "lost; 0 waits for as long as it takes")
          ->type_name("MS")
          ->check(CLI::Range(0.0, 1e6))
          ->group(kPaceGroup)
          ->capture_default_str();
  add_record_options(*command, options->record);
  add_report_option(*command, options->web);
  add_view_options(*command, options->web);
  PaceOptions& pace = options->stream.pace;
  CLI::Option* fps = command
                         ->add_option("--fps", pace.fps,
                                      "play the frames in real time, so many a second, as a camera would: the newest "
                                      "wins, drops are counted")
                         ->type_name("N");
  command->add_option("--minutes", pace.minutes, "play them round and round until then")
      ->type_name("M")
      ->needs(fps)
      ->group(kPaceGroup);
  CLI::Option* behind =
      command
          ->add_option("--behind", pace.behind,
                       "with --track: windows go by the result so many frames before; 1 lets nothing overlap")
          ->type_name("N")
          ->group(kPaceGroup)
          ->capture_default_str();
  CLI::Option* stream = command
                            ->add_flag("--stream", pace.stream,
                                       "a camera's frames through the pipeline: device and host overlap, the newest "
                                       "wins, drops and latencies are counted; the options below imply it")
                            ->excludes(fps);
  std::vector<CLI::Option*> pipeline = add_pace_options(*command, pace);
  pipeline.push_back(behind);
  pipeline.push_back(hang_after);
  add_ros_options(*command, options->ros);
  add_engine_options(*command, options->stream.engine);
  add_deviation_options(*command, options->stream.engine);
  add_stream_backend_options(*command, options->stream.engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code, pipeline, stream, known_answer, part] {
    PaceOptions& given = options->stream.pace;
    const bool is_camera = names_camera(options->source);
    if (given.fps != 0 && is_camera) {
      throw Error(options->source +
                  ": --fps plays recordings, a camera has a pace of its own; leave --fps out, --stream takes its "
                  "frames through the pipeline");
    }
    const auto set = std::find_if(pipeline.begin(), pipeline.end(), [](CLI::Option* o) { return o->count() > 0; });
    if (is_camera) {
      given.stream = given.stream || set != pipeline.end();
    } else if (stream->count() > 0 || (set != pipeline.end() && given.fps == 0)) {
      throw Error((stream->count() > 0 ? "--stream" : (*set)->get_name()) +
                  " is for a camera's frames (v4l2:, aravis:, gst:); play those of a recording by --fps");
    }
    if (options->stream.known_answer_s > 0 && !options->stream.engine.lockstep.empty()) {
      throw Error(
          "--known-answer asks one backend at a time, and --lockstep compares every frame of two; leave one of "
          "the two out");
    }
    if (known_answer->count() == 0 && (is_camera || given.fps != 0)) options->stream.known_answer_s = kKnownAnswerS;
    if (options->stream.fail_back_s > 0 && !options->stream.engine.lockstep.empty()) {
      throw Error(
          "--fail-back goes back to a backend that was left, and --lockstep leaves none; leave one of the two out");
    }
    if (options->stream.fail_back_s > 0 && options->stream.known_answer_s == 0) {
      throw Error("--fail-back believes a backend again by its known answers; give --known-answer SECONDS, too");
    }
    if (options->stream.track && !options->stream.engine.target_files.empty()) {
      throw Error(
          "--track searches in windows, which show markers alone; --target needs whole frames: leave one of the two "
          "out");
    }
    if (!options->record.file.empty() && is_same_file(options->source, options->record.file)) {
      throw Error(options->record.file + ": it is the source itself; record in another file");
    }
    if (part) part(*options);
    if (options->ros.on) options->stream.observers.push_back(make_ros_publisher(make_ros_plan(options->ros)));
    const std::unique_ptr<Source> source = open_source(options->source);
    options->web.source = options->source;
    options->web.is_filtered = options->stream.filter;
    add_web_observers(options->web, options->stream.log == "-" ? console.err() : console.out(),
                      options->stream.observers);
    if (std::unique_ptr<FrameObserver> notify = service_notify()) {
      options->stream.observers.push_back(std::move(notify));
    }
    // Its own observers, which end before the source does.
    StreamOptions recorded = options->stream;
    if (!options->record.file.empty()) {
      const bool paced = is_camera || given.fps != 0;
      recorded.observers.push_back(std::make_shared<Recorder>(options->record, describe_run(recorded, options->source),
                                                              paced, source->camera(), console));
    }
    exit_code = run_stream(*source, recorded, console).differing == 0 ? kOk : kNoResult;
  });
}

}  // namespace berth::cli
