#pragma once

namespace berth::cli {

/// Images judged at one threshold, counted: target there or not, found or not.
struct Decisions {
  int right_found = 0;
  int missed = 0;
  int false_found = 0;
  int right_absent = 0;

  void count(bool is_present, bool is_found) {
    (is_present ? is_found ? right_found : missed : is_found ? false_found : right_absent)++;
  }
  int present() const { return right_found + missed; }
  int absent() const { return false_found + right_absent; }
  int found() const { return right_found + false_found; }
  int all() const { return present() + absent(); }
  int wrong() const { return missed + false_found; }

  /// Shares, 0 of none.
  double true_positive_rate() const { return share(right_found, present()); }
  double false_positive_rate() const { return share(false_found, absent()); }
  double precision() const { return share(right_found, found()); }
  double accuracy() const { return share(all() - wrong(), all()); }

 private:
  static double share(int part, int whole) { return whole == 0 ? 0 : static_cast<double>(part) / whole; }
};

}  // namespace berth::cli
