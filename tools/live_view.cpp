#include "live_view.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

namespace berth::cli {
namespace {

using Seconds = std::chrono::duration<double>;

std::size_t terminal_columns() {
  winsize size = {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

}  // namespace

LiveView::LiveView(std::ostream& out, bool terminal, std::optional<std::size_t> total)
    : out_(out), terminal_(terminal), total_(total), plain_every_(total ? std::max<std::size_t>(1, *total / 20) : 30) {}

std::string LiveView::progress(std::size_t done) const {
  if (!total_ || *total_ == 0) return fmt::format("frame {}", done);
  const double elapsed_s = Seconds(Clock::now() - start_).count();
  const std::size_t left = *total_ > done ? *total_ - done : 0;
  return fmt::format("frame {:>4} of {} ({:>3}%), {:.0f} s left", done, *total_, 100 * done / *total_,
                     done == 0 ? 0 : elapsed_s / static_cast<double>(done) * static_cast<double>(left));
}

void LiveView::show(std::size_t done, const std::string& line, const std::vector<std::string>& table,
                    const std::string& brief) {
  const Clock::time_point now = Clock::now();
  if (!terminal_) {
    if (done != 1 && done % plain_every_ != 0 && now - shown_ < std::chrono::seconds(5)) return;
    shown_ = now;
    out_ << progress(done) << "  " << line << "  " << brief << std::endl;
    return;
  }
  if (done != 1 && (!total_ || done != *total_) && now - shown_ < std::chrono::milliseconds(90)) return;
  shown_ = now;
  if (lines_ > 0) out_ << fmt::format("\x1b[{}F", lines_);
  // A wrapped line would break the count of lines to go back.
  const std::size_t columns = terminal_columns();
  const auto put = [&](const std::string& text) { out_ << "\x1b[2K" << text.substr(0, columns - 1) << '\n'; };
  put(progress(done) + "  " + line);
  for (const std::string& row : table) put(row);
  out_ << "\x1b[J" << std::flush;
  lines_ = table.size() + 1;
}

void LiveView::finish() {
  if (terminal_ && lines_ > 0) out_ << '\n';
  lines_ = 0;
}

}  // namespace berth::cli
