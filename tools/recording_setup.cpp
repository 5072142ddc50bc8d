#include "recording_setup.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "frame_json.hpp"
#include "moment_record.hpp"
#include "output_file.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOptions = "options";

mcap::Bytes read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  mcap::Bytes bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.is_open() || file.bad())
    throw Error(path + ": the file cannot be read; check the name and its permissions");
  return bytes;
}

/// Attaches a file by a name of its own and returns that: "bundle0.yaml". Of "FILE#cam1", the end stays.
std::string attach(const std::string& path, const std::string& name, RecordingSetup& setup) {
  std::error_code ignored;
  const std::size_t mark = path.rfind('#');
  const bool named = mark != std::string::npos && !fs::exists(path, ignored);
  const std::string file = named ? path.substr(0, mark) : path;
  const std::string extension = fs::path(file).extension().string() == ".json" ? ".json" : ".yaml";
  setup.files.push_back(
      {name + extension, extension == ".json" ? "application/json" : "application/yaml", read_bytes(file)});
  return name + extension + (named ? path.substr(mark) : "");
}

Json attach_all(const std::vector<std::string>& paths, const std::string& name, RecordingSetup& setup) {
  Json names = Json::array();
  for (std::size_t i = 0; i < paths.size(); ++i) names.push_back(attach(paths[i], name + std::to_string(i), setup));
  return names;
}

const char* name_of(CameraFit fit) {
  return fit == CameraFit::resize ? "resize" : fit == CameraFit::crop ? "crop" : "none";
}

}  // namespace

RecordingSetup describe_run(const StreamOptions& options, const std::string& source_name) {
  RecordingSetup setup;
  const EngineOptions& engine = options.engine;
  Json json;
  json["family"] = engine.families;
  json["camera"] = engine.camera_file.empty() ? "" : attach(engine.camera_file, "camera", setup);
  json["camera_fit"] = name_of(engine.camera_fit);
  json["size"] = engine.size;
  json["size_deviation"] = engine.size_deviation;
  json["edge_deviation"] = engine.edge_deviation;
  json["bundle"] = attach_all(engine.bundle_files, "bundle", setup);
  json["target"] = attach_all(engine.target_files, "target", setup);
  json["pose"] = engine.pose;
  json["corners"] = engine.corners;
  json["max_hamming"] = engine.max_hamming;
  json["digests"] = options.digests;
  json["filter"] = options.filter;
  json["track"] = options.track;
  json["full_every"] = options.full_every;
  json["behind"] = options.pace.fps != 0 || options.pace.stream ? options.pace.behind : 0;
  setup.settings[kOptions] = to_line(json);
  setup.settings["source"] = source_name;
  return setup;
}

RestoredFiles::RestoredFiles() {
  std::string pattern = (fs::temp_directory_path() / "berth-recording-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) {
    throw Error(pattern + ": the folder for the recorded files cannot be made; set TMPDIR to one that is writable");
  }
  path_ = pattern;
}

RestoredFiles::~RestoredFiles() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

StreamOptions restore_run(const mcap::Reader& recording, const std::string& path, const std::string& folder) {
  const mcap::Metadata* const run = recording.find_metadata(kRunMetadata);
  if (recording.find_metadata(kStationsMetadata) != nullptr) {
    throw Error(path + ": it is of two stations; berth stations FILE --replay runs them again");
  }
  if (run == nullptr || run->values.count(kOptions) == 0) {
    throw Error(path + ": it does not say how it was made: no recording of berth run; use --source mcap:" + path +
                " with the options that fit");
  }
  const auto restored = [&](const std::string& name) {
    const std::size_t mark = name.find('#');
    const std::string file = name.substr(0, mark);
    const mcap::Attachment* const attached = recording.find_attachment(file);
    // A name with a slash in it would be written elsewhere.
    if (attached == nullptr || file.find('/') != std::string::npos) {
      throw Error(path + ": attachment '" + file + "' is missing; the recording is damaged");
    }
    const std::string to = (fs::path(folder) / file).string();
    write_file(to, "the recorded file", std::string(attached->data.begin(), attached->data.end()));
    return to + (mark == std::string::npos ? "" : name.substr(mark));
  };
  StreamOptions options;
  EngineOptions& engine = options.engine;
  try {
    const Json json = Json::parse(run->values.at(kOptions));
    engine.families = json.at("family").get<std::vector<std::string>>();
    const std::string camera = json.at("camera");
    if (!camera.empty()) engine.camera_file = restored(camera);
    const std::string fit = json.at("camera_fit");
    engine.camera_fit = fit == "resize" ? CameraFit::resize : fit == "crop" ? CameraFit::crop : CameraFit::none;
    engine.size = json.at("size");
    engine.size_deviation = json.at("size_deviation");
    engine.edge_deviation = json.at("edge_deviation");
    for (const std::string name : json.at("bundle")) engine.bundle_files.push_back(restored(name));
    for (const std::string name : json.at("target")) engine.target_files.push_back(restored(name));
    engine.pose = json.at("pose");
    engine.corners = json.at("corners");
    engine.max_hamming = json.at("max_hamming");
    options.digests = json.at("digests");
    options.filter = json.at("filter");
    options.track = json.at("track");
    options.full_every = json.at("full_every");
    options.behind = json.at("behind");
  } catch (const Json::exception& error) {
    throw Error(path + ": metadata '" + kRunMetadata + "': field '" + kOptions + "' cannot be read (" + error.what() +
                "); the recording is damaged, or of a later version");
  }
  // "simd on NAME"
  const auto backend = run->values.find("backend");
  if (backend != run->values.end()) engine.backend = backend->second.substr(0, backend->second.find(' '));
  return options;
}

}  // namespace berth::cli
