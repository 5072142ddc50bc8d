#include "web_options.hpp"

#include "berth/error.hpp"
#include "interrupt.hpp"

namespace berth::cli {

void add_view_options(CLI::App& command, WebOptions& options) {
  CLI::Option* view =
      command
          .add_option("--view", options.address,
                      "watch it in a browser at ADDRESS:PORT, 127.0.0.1:8040 unless given (docs/live-view.md)")
          ->type_name("ADDR")
          ->expected(0, 1)
          ->each([&options](const std::string&) { options.is_viewed = true; });
  command
      .add_option("--view-token", options.token_file,
                  "with --view: whoever shows this file's first line may end the run there; nobody otherwise")
      ->type_name("FILE")
      ->needs(view);
}

void add_report_option(CLI::App& command, WebOptions& options) {
  command.add_option("--report", options.report, "the run as one page, with plots and tables")->type_name("FILE");
}

void add_web_observers(const WebOptions& options, std::ostream& people,
                       std::vector<std::shared_ptr<FrameObserver>>& observers) {
#if BERTH_WITH_VIEW
  if (!options.report.empty()) observers.push_back(make_web_report(options));
  if (options.is_viewed) observers.push_back(make_web_view(options, people, InterruptWatch::ask));
#else
  (void)people;
  (void)observers;
  if (options.is_viewed || !options.report.empty()) {
    throw Error(
        "--view and --report: this build is without the live view; install libcpp-httplib-dev and libjs-three, then "
        "configure with -DBERTH_WITH_VIEW=ON");
  }
#endif
}

}  // namespace berth::cli
