// berth replay and berth recover: recordings of `berth run --record`.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "camera/sources.hpp"
#include "commands.hpp"
#include "recording/recover.hpp"
#include "recording_setup.hpp"
#include "replay_check.hpp"
#include "stream.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReplayExamples = R"(Examples:
  berth replay flight.mcap
  berth replay flight.mcap --backend opencl    other backends come to the same bits

Exit code 1: a frame differs from the recording, or could not be compared. Everything that a replay needs is in the file.)";

constexpr const char* kRecoverExamples = R"(Examples:
  berth recover flight.mcap                    writes flight.recovered.mcap, unless nothing is missing
  berth recover flight.mcap -o saved.mcap)";

struct ReplayOptions {
  std::string file;
  EngineOptions engine;
  std::uint64_t max_frames = 0;
};

int replay(const ReplayOptions& asked, Console& console) {
  const RestoredFiles files;
  StreamOptions options;
  {
    const mcap::Reader recording(asked.file);
    options = restore_run(recording, asked.file, files.path());
    const auto& run = recording.find_metadata(kRunMetadata)->values;
    const auto value = [&](const char* key) { return run.count(key) == 0 ? std::string("?") : run.at(key); };
    console.out() << fmt::format("recorded by berth {} from {}, on {}\n", value("version"), value("source"),
                                 value("backend"));
  }
  if (!asked.engine.backend.empty()) options.engine.backend = asked.engine.backend;
  options.engine.device = asked.engine.device;
  options.engine.threads = asked.engine.threads;
  options.max_frames = asked.max_frames;
  const std::unique_ptr<Source> source = open_mcap(asked.file);
  const auto check = std::make_shared<ReplayCheck>(asked.file, options.track || options.filter);
  options.observers.push_back(check);
  run_stream(*source, options, console);
  if (check->compared() == 0) throw Error(asked.file + ": it has no frame to compare; record with pictures");
  return check->differing() == 0 && check->not_compared() == 0 ? kOk : kNoResult;
}

int recover(const std::string& file, const std::string& asked, Console& console) {
  std::ostream& out = console.out();
  mcap::Recovery found = mcap::examine(file);
  const auto list_problems = [&] {
    for (const std::string& problem : found.problems.kept()) out << "  " << problem << '\n';
    const std::size_t more = found.problems.count() - found.problems.kept().size();
    if (more > 0) out << fmt::format("  and {} more\n", more);
  };
  if (found.whole) {
    out << fmt::format("{}: whole: {} messages in {} chunks; there is nothing to recover\n", file, found.messages,
                       found.chunks);
    return kOk;
  }
  const std::string to =
      asked.empty() ? (fs::path(file).parent_path() / (fs::path(file).stem().string() + ".recovered.mcap")).string()
                    : asked;
  found = mcap::recover(file, to, "berth " BERTH_VERSION " recover");
  out << fmt::format("{}: {} messages in {} whole chunks saved; {} of {} bytes behind the last whole one are lost\n",
                     file, found.messages, found.chunks, found.file_bytes - found.whole_bytes, found.file_bytes);
  list_problems();
  for (const auto& [topic, messages] : found.messages_by_topic) out << fmt::format("  {:<26} {}\n", topic, messages);
  out << "written     " << to << '\n';
  return kOk;
}

}  // namespace

void add_replay(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("replay", "Run a recording again and compare every digest and pose");
  const auto options = std::make_shared<ReplayOptions>();
  command->add_option("FILE", options->file, "a recording of berth run --record")->type_name("FILE")->required();
  command->add_option("--max-frames", options->max_frames, "end after so many frames, 0 for all")
      ->type_name("N")
      ->capture_default_str();
  add_backend_options(*command, options->engine);
  command->footer(kReplayExamples);
  command->callback([options, &console, &exit_code] { exit_code = replay(*options, console); });
}

void add_recover(CLI::App& app, Console& console, int& exit_code) {
  struct Options {
    std::string file, out;
  };
  CLI::App* command = app.add_subcommand("recover", "Make a whole file of a recording that is cut off or damaged");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "an MCAP file")->type_name("FILE")->required();
  command->add_option("-o,--out", options->out, "the file to write [FILE with .recovered in its name]")
      ->type_name("FILE");
  command->footer(kRecoverExamples);
  command->callback([options, &console, &exit_code] { exit_code = recover(options->file, options->out, console); });
}

}  // namespace berth::cli
