#pragma once

#include <iosfwd>
#include <ostream>
#include <string>

namespace berth::cli {

/// The command's exit codes (docs/command.md).
enum ExitCode { kOk = 0, kNoResult = 1, kBadInput = 2 };

/// Where a command writes. Results go to `out`; everything else (complaints, progress) to `err`.
class Console {
 public:
  Console(std::ostream& out, std::ostream& err, bool out_is_terminal)
      : out_(out), err_(err), out_is_terminal_(out_is_terminal) {}

  std::ostream& out() { return out_; }
  std::ostream& err() { return err_; }
  bool out_is_terminal() const { return out_is_terminal_; }

  /// "berth: MESSAGE" on err; the command ends with kBadInput, after the rest of its work.
  void complain(const std::string& message) {
    note(message);
    complained_ = true;
  }
  /// "berth: MESSAGE" on err, without consequence.
  void note(const std::string& message) {
    out_.flush();
    err_ << "berth: " << message << '\n' << std::flush;
  }
  bool complained() const { return complained_; }

 private:
  std::ostream& out_;
  std::ostream& err_;
  bool out_is_terminal_;
  bool complained_ = false;
};

/// The whole command: argv as main gets it. Returns the exit code and throws nothing.
int run_command(int argc, const char* const* argv, Console& console);

}  // namespace berth::cli
