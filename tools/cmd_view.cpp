// berth view: a recording in the live view's page.
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "berth/error.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#if BERTH_WITH_VIEW
#include "web_server.hpp"
#endif

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth view flight.mcap
  berth view flight.mcap --address 127.0.0.1:8041
  berth view flight.mcap --address 0.0.0.0:8040      for whoever reaches this machine

In the page: arrow keys go by frames, page keys by seconds, Home and End to the ends, the space bar plays and pauses.
Ctrl-C ends it.)";

int view(const std::string& path, const std::string& address, Console& console) {
#if BERTH_WITH_VIEW
  const WebAddress where = parse_web_address(address, "--address");
  const std::unique_ptr<RecordedRun> recording = RecordedRun::open(path);
  if (!recording->lack().empty()) console.note(path + ": " + recording->lack());
  WebFeed feed;
  WebContent content;
  content.feed = &feed;
  content.about_version = [] { return u64{1}; };
  content.about = [&recording] { return recording->about(); };
  content.times = [] { return Json::array(); };
  content.recording = recording.get();
  const InterruptWatch interrupt;
  const WebServer server(where, std::move(content));
  console.out() << "view        " << server.url() << '\n' << std::flush;
  while (!interrupt.came()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return kOk;
#else
  (void)path;
  (void)address;
  (void)console;
  throw Error(
      "view: this build is without the live view; install libcpp-httplib-dev and libjs-three, then configure with "
      "-DBERTH_WITH_VIEW=ON");
#endif
}

}  // namespace

void add_view(CLI::App& app, Console& console, int& exit_code) {
  struct Options {
    std::string file, address;
  };
  CLI::App* command = app.add_subcommand("view", "Look through a recording in a browser");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "a recording of berth run --record")->type_name("FILE")->required();
  command
      ->add_option("--address", options->address,
                   "where to serve the page, ADDRESS:PORT, 127.0.0.1:8040 unless given (docs/live-view.md)")
      ->type_name("ADDR");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = view(options->file, options->address, console); });
}

}  // namespace berth::cli
