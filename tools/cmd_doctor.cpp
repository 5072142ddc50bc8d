// berth doctor: what this machine has for Berth, what it lacks, and how to get it.
#include <dirent.h>
#include <fmt/format.h>

#include <CLI/Version.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "berth/backend.hpp"
#include "camera/aravis_camera.hpp"
#include "commands.hpp"
#include "frame_json.hpp"
#include "machine.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth doctor
  berth doctor --json | jq .backends)";

/// What is missing and the command that brings it.
struct Remedy {
  std::string missing;
  std::string command;
};

/// OpenCL drivers announce themselves as .icd files, which the loader reads.
bool has_opencl_driver() {
  const char* vendors = std::getenv("OCL_ICD_VENDORS");
  DIR* folder = opendir(vendors != nullptr ? vendors : "/etc/OpenCL/vendors");
  if (folder == nullptr) return false;
  bool found = false;
  while (const dirent* entry = readdir(folder)) {
    const std::string name = entry->d_name;
    found = found || (name.size() > 4 && name.compare(name.size() - 4, 4, ".icd") == 0);
  }
  closedir(folder);
  return found;
}

std::vector<Remedy> remedies(const std::vector<BackendStatus>& backends, const KernelCache& cache) {
  std::vector<Remedy> all;
  for (const BackendStatus& backend : backends) {
    if (backend.absent.empty()) continue;
    Remedy remedy = {"backend " + backend.name + ": " + backend.absent, ""};
    if (backend.name == "opencl") {
      remedy.command = has_opencl_driver() ? "apt install ocl-icd-libopencl1 clinfo && clinfo -l"
                                           : "apt install ocl-icd-libopencl1 pocl-opencl-icd";
    }
    all.push_back(remedy);
  }
  if (!cache.writable) {
    all.push_back({"the kernel cache " + cache.path + " cannot be written: kernels are compiled at every start",
                   "export XDG_CACHE_HOME=FOLDER (one that you can write)"});
  }
  return all;
}

/// By names that stay the same after a restart, as --source takes them. Looking into the network takes a second.
std::vector<std::string> cameras() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/v4l/by-path", error)) {
    names.push_back("v4l2:by-path/" + entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  for (std::string& name : list_aravis_cameras()) names.push_back(std::move(name));
  return names;
}

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

Json describe() {
  const std::vector<BackendStatus> backends = probe_backends();
  const Processor processor = this_processor();
  const KernelCache cache = kernel_cache();
  Json json = {{"berth", BERTH_VERSION},
               {"build", {{"compiler", compiler()}, {"type", BERTH_BUILD_TYPE}}},
               {"libraries", {{"opencv", opencv_version()}, {"fmt", FMT_VERSION}, {"cli11", CLI11_VERSION}}},
               {"system", this_system()},
               {"processor",
                {{"model", processor.model},
                 {"threads", processor.threads},
                 {"vector_extensions", processor.vector_extensions}}},
               {"backends", Json::array()},
               {"cameras", cameras()},
               {"kernel_cache",
                {{"path", cache.path},
                 {"exists", cache.exists},
                 {"writable", cache.writable},
                 {"entries", cache.entries},
                 {"bytes", cache.bytes}}},
               {"missing", Json::array()}};
  for (const BackendStatus& backend : backends) {
    Json devices = Json::array();
    for (const DeviceInfo& device : backend.devices)
      devices.push_back({{"name", device.name}, {"driver", device.driver}});
    Json entry = {{"name", backend.name}, {"available", backend.absent.empty()}, {"devices", devices}};
    if (!backend.absent.empty()) entry["absent"] = backend.absent;
    json["backends"].push_back(entry);
  }
  for (const Remedy& remedy : remedies(backends, cache)) {
    json["missing"].push_back({{"what", remedy.missing}, {"remedy", remedy.command}});
  }
  return json;
}

std::string text_of(const Json& json) { return json.get<std::string>(); }

void print(const Json& json, std::ostream& out) {
  const auto line = [&](const char* name, const std::string& value) { out << fmt::format("{:<13} {}\n", name, value); };
  line("berth",
       text_of(json["berth"]) + ", " + text_of(json["build"]["type"]) + ", " + text_of(json["build"]["compiler"]));
  line("libraries",
       "OpenCV " + text_of(json["libraries"]["opencv"]) + ", CLI11 " + text_of(json["libraries"]["cli11"]));
  line("system", text_of(json["system"]));
  std::string extensions;
  for (const Json& extension : json["processor"]["vector_extensions"]) extensions += " " + text_of(extension);
  line("processor", fmt::format("{}, {} threads,{}", text_of(json["processor"]["model"]),
                                json["processor"]["threads"].get<unsigned>(), extensions));
  const Json& cache = json["kernel_cache"];
  line("kernel cache",
       fmt::format("{}, {} entries, {:.1f} kB{}", text_of(cache["path"]), cache["entries"].get<std::uint64_t>(),
                   static_cast<double>(cache["bytes"].get<std::uint64_t>()) / 1000,
                   cache["writable"].get<bool>() ? "" : ", not writable"));
  out << "backends, the first available is the default\n";
  for (const Json& backend : json["backends"]) {
    const std::string name = text_of(backend["name"]);
    int index = 0;
    for (const Json& device : backend["devices"]) {
      out << fmt::format("  {:<11} {}: {} ({})\n", index == 0 ? name : "", index, text_of(device["name"]),
                         text_of(device["driver"]));
      ++index;
    }
    if (!backend["available"].get<bool>()) out << fmt::format("  {:<11} absent\n", name);
  }
  out << "cameras, for --source\n";
  for (const Json& camera : json["cameras"]) out << "  " << text_of(camera) << '\n';
  if (json["cameras"].empty()) out << "  none in /dev/v4l/by-path, none by Aravis\n";
  if (json["missing"].empty()) {
    out << "nothing is missing\n";
    return;
  }
  out << "missing\n";
  for (const Json& missing : json["missing"]) {
    out << "  " << text_of(missing["what"]) << '\n';
    if (!text_of(missing["remedy"]).empty()) out << "    remedy: " << text_of(missing["remedy"]) << '\n';
  }
}

}  // namespace

void add_doctor(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("doctor", "Show backends, devices and versions, what is missing and the remedy");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "as one JSON object");
  command->footer(kExamples);
  command->callback([json, &console, &exit_code] {
    const Json description = describe();
    if (*json) {
      console.out() << description.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
      print(description, console.out());
    }
    exit_code = kOk;
  });
}

}  // namespace berth::cli
