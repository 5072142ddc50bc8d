// berth verify: every backend against the reference, on this machine.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "camera/image_file.hpp"
#include "commands.hpp"
#include "frame_json.hpp"
#include "output_file.hpp"
#include "verify/verify.hpp"

namespace berth::cli {
namespace {

constexpr const char* kReference = "reference";

constexpr const char* kExamples = R"(Examples:
  berth verify
  berth verify --backend opencl --device pocl
  berth verify --image photo.png --image dock.jpg
  berth verify --frames 1000                     as many mixed frames besides: corpora, noise, mazes
  berth verify --soak 60 --json soak.json        mixed frames for an hour; the report for a machine
  BERTH_EXPECT=simd,cpu,opencl berth verify      a missing backend is a failure

Every operation and whole frames run on each device of each backend and on the reference; every bit must agree.)";

struct VerifyCommand {
  std::vector<std::string> backends;
  std::vector<std::string> images;
  BackendOptions backend;
  MixedOptions mixed;
  std::string report;
};

/// A device of a backend that is verified, and what came of it.
struct Target {
  std::string name;
  std::string device;
  /// Why it did not open; empty when it did.
  std::string absent;
  bool needed = false;
  std::unique_ptr<Backend> backend;
  VerifyReport built_in;
  VerifyReport mixed;

  bool ok() const { return absent.empty() ? built_in.ok && mixed.ok : !needed; }
};

std::vector<std::string> split_at_commas(const std::string& list) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : list + ",") {
    if (c != ',') {
      word += c;
    } else if (!word.empty()) {
      words.push_back(word);
      word.clear();
    }
  }
  return words;
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Those named, else all that this build has; the reference itself is what they are compared with.
std::vector<std::string> candidates(const VerifyCommand& command) {
  for (const std::string& name : command.backends) {
    if (contains(backend_names(), name)) continue;
    std::string known;
    for (const std::string& other : backend_names()) known += (known.empty() ? "" : ", ") + other;
    throw bad_field("command line", "--backend", "'" + name + "'", "use one of " + known);
  }
  if (!command.backends.empty()) return command.backends;
  std::vector<std::string> names = backend_names();
  names.erase(std::remove(names.begin(), names.end(), kReference), names.end());
  return names;
}

/// Every device of the backends, opened. Those that do not open say why.
std::vector<Target> open_targets(const std::vector<std::string>& names, const VerifyCommand& command,
                                 const std::vector<std::string>& expected) {
  std::vector<Target> targets;
  const std::vector<BackendStatus> probed = probe_backends();
  for (const std::string& name : names) {
    const bool needed = contains(expected, name) || contains(command.backends, name);
    const auto status =
        std::find_if(probed.begin(), probed.end(), [&](const BackendStatus& s) { return s.name == name; });
    // Without a device one attempt tells why.
    const std::size_t devices = command.backend.device.empty() ? std::max<std::size_t>(status->devices.size(), 1) : 1;
    for (std::size_t i = 0; i < devices; ++i) {
      Target target;
      target.name = name;
      target.needed = needed;
      BackendOptions options = command.backend;
      if (options.device.empty() && devices > 1) options.device = std::to_string(i);
      try {
        target.backend = open_backend(name, options);
        target.device = target.backend->device().name;
      } catch (const Error& error) {
        target.absent = error.what();
      }
      targets.push_back(std::move(target));
    }
  }
  return targets;
}

void verify_built_in(Target& target, Backend& reference, VerifyOptions& options, Console& console) {
  if (console.out_is_terminal()) {
    options.progress = [&](int done, int all) {
      console.out() << fmt::format("\r{:<10} {} of {}\x1b[K", target.name, done, all) << std::flush;
    };
  }
  target.built_in = verify_backend(*target.backend, reference, options);
  if (console.out_is_terminal()) console.out() << "\r\x1b[K";
  const VerifyReport& report = target.built_in;
  console.out() << fmt::format("{:<10} {}  {} cases, {} frames, {:.1f} s, {}\n", target.name,
                               report.ok ? "ok     " : "DIFFERS", report.cases, report.frames, report.seconds,
                               target.device);
  if (!report.ok) console.out() << "           first difference: " << report.first_difference << '\n';
  console.out().flush();
}

void verify_mixed_frames(std::vector<Target>& targets, Backend& reference, MixedOptions options, Console& console) {
  std::vector<Target*> opened;
  std::vector<Backend*> backends;
  for (Target& target : targets) {
    if (target.backend == nullptr || !target.built_in.ok) continue;
    opened.push_back(&target);
    backends.push_back(target.backend.get());
  }
  if (console.out_is_terminal()) {
    options.progress = [&](int done, double minutes) {
      console.out() << fmt::format("\r{} mixed frames, {:.1f} min\x1b[K", done, minutes) << std::flush;
    };
  }
  const std::vector<VerifyReport> reports = verify_mixed(backends, reference, options);
  if (console.out_is_terminal()) console.out() << "\r\x1b[K";
  for (std::size_t i = 0; i < reports.size(); ++i) {
    opened[i]->mixed = reports[i];
    console.out() << fmt::format("{:<10} {}  {} mixed frames, {}\n", opened[i]->name,
                                 reports[i].ok ? "ok     " : "DIFFERS", reports[i].frames, opened[i]->device);
    if (!reports[i].ok) console.out() << "           first difference: " << reports[i].first_difference << '\n';
  }
  console.out().flush();
}

void write_report(const std::string& path, const std::vector<Target>& targets) {
  Json list = Json::array();
  for (const Target& target : targets) {
    Json json;
    json["backend"] = target.name;
    json["ok"] = target.ok();
    if (!target.absent.empty()) {
      json["absent"] = target.absent;
    } else {
      json["device"] = target.device;
      json["driver"] = target.backend->device().driver;
      json["cases"] = target.built_in.cases;
      json["frames"] = target.built_in.frames;
      json["mixed_frames"] = target.mixed.frames;
      json["seconds"] = target.built_in.seconds + target.mixed.seconds;
      const std::string& first = target.built_in.ok ? target.mixed.first_difference : target.built_in.first_difference;
      if (!first.empty()) json["first_difference"] = first;
    }
    list.push_back(json);
  }
  write_file(path, "the report", to_line(list) + '\n');
}

int run_verify(const VerifyCommand& command, Console& console) {
  const char* expected_list = std::getenv("BERTH_EXPECT");
  const std::vector<std::string> expected = split_at_commas(expected_list == nullptr ? "" : expected_list);
  std::vector<std::string> names = candidates(command);
  bool all_ok = true;
  for (const std::string& name : expected) {
    if (contains(backend_names(), name)) {
      if (command.backends.empty() && name != kReference && !contains(names, name)) names.push_back(name);
      continue;
    }
    console.out() << fmt::format("{:<10} MISSING  this build has no such backend (BERTH_EXPECT)\n", name);
    all_ok = false;
  }
  VerifyOptions options;
  for (const std::string& path : command.images) {
    try {
      options.images.push_back({path, read_gray_image(path)});
    } catch (const Error& error) {
      console.complain(error.what());
    }
  }
  const std::unique_ptr<Backend> reference = open_backend(kReference);
  std::vector<Target> targets = open_targets(names, command, expected);
  for (Target& target : targets) {
    if (target.absent.empty()) {
      verify_built_in(target, *reference, options, console);
    } else {
      console.out() << fmt::format("{:<10} {}  {}\n", target.name, target.needed ? "MISSING" : "absent ", target.absent)
                    << std::flush;
    }
  }
  if (command.mixed.frames > 0 || command.mixed.minutes > 0) {
    verify_mixed_frames(targets, *reference, command.mixed, console);
  }
  for (const Target& target : targets) all_ok = all_ok && target.ok();
  if (!command.report.empty()) write_report(command.report, targets);
  return all_ok ? kOk : kNoResult;
}

}  // namespace

void add_verify(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("verify", "Compare every backend with the reference, bit by bit");
  const auto options = std::make_shared<VerifyCommand>();
  command->add_option("--backend", options->backends, "backend to verify; may be repeated or a comma list [all]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--device", options->backend.device, "its device, by index or by a part of its name [every one]")
      ->type_name("DEVICE");
  command->add_option("--threads", options->backend.threads, "threads of the CPU backends, 0 for every core")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--image", options->images, "image to verify whole frames on, beside the built-in ones")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command->add_option("--frames", options->mixed.frames, "so many mixed frames besides: corpora, noise, mazes")
      ->type_name("N")
      ->check(CLI::Range(0, 100000000));
  command->add_option("--soak", options->mixed.minutes, "mixed frames for so long")
      ->type_name("MINUTES")
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--json", options->report, "a report for machines")->type_name("FILE");
  command->add_flag("--baseline", options->backend.baseline_only,
                    "devices keep to what every one must have: nothing that a better one offers");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_verify(*options, console); });
}

}  // namespace berth::cli
