#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <vector>

#include "web_view.hpp"

namespace berth::cli {

/// --view, --view-token
void add_view_options(CLI::App& command, WebOptions& options);
/// --report
void add_report_option(CLI::App& command, WebOptions& options);

/// Adds those asked for; the view's address goes to `people`. Throws Error, in a build without them too.
void add_web_observers(const WebOptions& options, std::ostream& people,
                       std::vector<std::shared_ptr<FrameObserver>>& observers);

}  // namespace berth::cli
