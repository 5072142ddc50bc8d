// berth verify: every backend against the reference, on this machine.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "camera/image_file.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "verify/verify.hpp"

namespace berth::cli {
namespace {

constexpr const char* kReference = "reference";

constexpr const char* kExamples = R"(Examples:
  berth verify
  berth verify --backend opencl --device pocl
  berth verify --image photo.png --image dock.jpg
  BERTH_EXPECT=simd,cpu,opencl berth verify      a missing backend is a failure

Every operation and whole frames run on each backend and on the reference; every bit must agree.)";

struct VerifyCommand {
  std::vector<std::string> backends;
  std::vector<std::string> images;
  EngineOptions engine;
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

/// Returns whether the backend passed; a backend that is absent fails only where it was asked for or expected.
bool verify_one(const std::string& name, bool needed, Backend& reference, VerifyOptions& options,
                const VerifyCommand& command, Console& console) {
  std::unique_ptr<Backend> candidate;
  BackendOptions backend_options;
  backend_options.device = command.engine.device;
  backend_options.threads = command.engine.threads;
  try {
    candidate = open_backend(name, backend_options);
  } catch (const Error& error) {
    console.out() << fmt::format("{:<10} {}  {}\n", name, needed ? "MISSING" : "absent ", error.what()) << std::flush;
    return !needed;
  }
  if (console.out_is_terminal()) {
    options.progress = [&](int done, int all) {
      console.out() << fmt::format("\r{:<10} {} of {}\x1b[K", name, done, all) << std::flush;
    };
  }
  const VerifyReport report = verify_backend(*candidate, reference, options);
  if (console.out_is_terminal()) console.out() << "\r\x1b[K";
  console.out() << fmt::format("{:<10} {}  {} cases, {} frames, {:.1f} s, {}\n", name,
                               report.ok ? "ok     " : "DIFFERS", report.cases, report.frames, report.seconds,
                               candidate->device().name);
  if (!report.ok) console.out() << "           first difference: " << report.first_difference << '\n';
  console.out().flush();
  return report.ok;
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
  for (const std::string& name : names) {
    const bool needed = contains(expected, name) || contains(command.backends, name);
    all_ok = verify_one(name, needed, *reference, options, command, console) && all_ok;
  }
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
  command->add_option("--device", options->engine.device, "its device, by index or by a part of its name")
      ->type_name("DEVICE");
  command->add_option("--threads", options->engine.threads, "threads of the CPU backends, 0 for every core")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--image", options->images, "image to verify whole frames on, beside the built-in ones")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_verify(*options, console); });
}

}  // namespace berth::cli
