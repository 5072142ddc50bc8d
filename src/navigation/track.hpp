#pragma once

#include <vector>

#include "navigation/candidates.hpp"

namespace berth {

/// What one window said.
struct Reading {
  int logit_q8 = 0;
  Place place;
};

/// When a track is believed, and for how long; log-odds in 1/256.
struct TrackRules {
  /// A frame's log-odds less this are its evidence, at most `most_q8` of it: neighbouring frames are no independent
  /// ones.
  int doubt_q8 = 0;
  int most_q8 = 0;
  /// So much evidence in all makes a track believed.
  int believed_q8 = 0;
  /// A believed track that is not seen in so many frames running is given up.
  int memory_frames = 5;
};

/// A place where a target was seen, how it moves, and what speaks for it: evidence over frames, in integers.
class Track {
 public:
  explicit Track(const TrackRules& rules) : rules_(rules) {}

  bool alive() const { return alive_; }
  /// Whether the evidence is enough to say that there is a target.
  bool believed() const { return alive_ && believed_; }
  /// Where it is looked for next: where it was seen last, moved on as it moved before. No measurement.
  Place expected() const;
  /// Frames running that it was not seen in.
  int missed() const { return missed_; }
  int evidence_q8() const { return evidence_q8_; }

  /// The first sight of something; whatever was followed is forgotten.
  void begin(const Reading& reading);
  /// A place that is known from elsewhere.
  void believe(const Place& place);
  /// Seen again in the next frame. What has more against it than for it before it is believed is given up.
  void see(const Reading& reading);
  /// Not seen in the next frame: given up unless it is believed and not for too long.
  void miss();
  void give_up() { alive_ = false; }

  /// Whether this may be the same target: near enough to where it is expected, and of about its size.
  /// `sure`: what is sure to be one may have moved three times as far.
  bool fits(const Place& place, bool sure = false) const;

 private:
  void add(int logit_q8);

  TrackRules rules_;
  Place place_;                                   // where it was seen last
  std::int64_t step_x_q16_ = 0, step_y_q16_ = 0;  // from frame to frame
  bool alive_ = false, believed_ = false;
  int evidence_q8_ = 0;
  int missed_ = 0;
};

/// Several windows around one place as one: the mean of log-odds and places of those that fit the track, one that does
/// not counting as log-odds of `misfit_q8`. False where fewer than half fit.
bool agreed(const Track& track, const std::vector<Reading>& readings, int misfit_q8, Reading& reading);

}  // namespace berth
