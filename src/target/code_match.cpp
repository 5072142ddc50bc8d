#include "target/code_match.hpp"

#include <algorithm>
#include <array>

#include "target/blur.hpp"
#include "target/evidence.hpp"
#include "target/near_words.hpp"
#include "target/short_list.hpp"

namespace berth {
namespace {

using Levels = std::array<double, kMaxCells>;

// Chances that a pattern which is no marker is taken for one, per quadrilateral whose border looked right.
constexpr double kWrongBitsChance = 2e-4;  // by the number of wrong bits alone
constexpr double kBitsLikeChance = 1e-3;   // bits right, levels like noise
// The same for families of which wrong bits are accepted: at 1e-3 clutter with large modules was taken for tag25h9 22
// times in a million frames. Corpora lose no marker by it, since faint ones are read by their levels.
constexpr double kWrongBitsLikeChance = 1e-7;
// But a marker with as many wrong bits needs no more than this share of the likeness that it has without noise.
constexpr double kDamagedShare = 0.95;
constexpr double kLevelsLikeChance = 1e-5;  // levels like noise
// Levels like a random pattern, which is what other markers are. The model is kinder than nature: on rendered patterns
// of 12 to 34 px the rate found was some hundred times this; at 1e-3 recall is one percent higher, at 1e-7 two lower.
constexpr double kEvidenceChance = 2e-6;
// With hardly a pixel a module the levels cannot decide every cell, and the blur model ends. On rendered clutter the
// levels were believed there once in 250 frames; the smallest markers that are read have twice this.
constexpr double kLeastModule_px2 = 1.2;
// How much likelier (squared) the best code must be than the next.
constexpr double kRivalOdds = 1e6;

// Lens blur supposed before anything is known, and the ones tried on a candidate, px.
constexpr double kUsualBlur_px = 0.8;
constexpr double kTriedBlur_px[] = {0.5, 1.0, 1.6};

double power(double base, int exponent) {
  double result = 1;
  for (int i = 0; i < exponent; ++i) result *= base;
  return result;
}

// Noise correlates with one given pattern of n points to r² or more with a chance below (1 - r²)^((n - 2) / 2); this is
// the r² at which that chance, over all words, falls to `chance`.
double likeness_for(int bits, std::size_t words, double chance) {
  const double per_word = chance / static_cast<double>(words);
  double low = 0, high = 1;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (power(1 - middle, bits - 2) > per_word * per_word ? low : high) = middle;
  }
  return high;
}

// The most wrong bits for which a random word is taken for a code rarely enough.
int safe_hamming(int bits, std::size_t words, int wanted) {
  double ways = 1, near = 1;
  for (int i = 0; i < bits; ++i) near /= 2;
  near *= static_cast<double>(words);
  int hamming = 0;
  double total = near;
  while (hamming < wanted) {
    ways = ways * (bits - hamming) / (hamming + 1);
    total += near * ways;
    if (total > kWrongBitsChance) break;
    ++hamming;
  }
  return hamming;
}

// What a reading must have whose bits are those of one of the words.
double likeness_of_bits(int bits, std::size_t words, int correctable) {
  const int wrong_bits = safe_hamming(bits, words, correctable);
  if (wrong_bits == 0) return likeness_for(bits, words, kBitsLikeChance);
  // Squared correlation of a word, half of it light, with itself after so many bits were turned over.
  const double damaged = power(1 - 2.0 * wrong_bits / bits, 2);
  return std::min(likeness_for(bits, words, kWrongBitsLikeChance), kDamagedShare * damaged);
}

int correctable_bits(const MarkerFamily& family) { return std::max(0, (family.min_hamming - 1) / 2); }

int allowed_hamming(const MarkerFamily& family, int max_hamming) {
  return safe_hamming(static_cast<int>(family.bit_x.size()), 4 * family.codes.size(),
                      std::min(max_hamming, correctable_bits(family)));
}

// The reading about its mean, ready to be compared with codes.
struct Centred {
  Levels value;
  double squares = 0;
  std::size_t n;

  Centred(const Reading& reading, std::size_t cells) : n(cells) {
    double mean = 0;
    for (std::size_t i = 0; i < n; ++i) mean += reading.value[i];
    mean /= static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      value[i] = reading.value[i] - mean;
      squares += value[i] * value[i];
    }
  }

  // Squared correlation with what a code word shows under the blur; 0 where it is negative.
  double likeness(const Layout& layout, u64 word, BlurTaps taps) const {
    Levels shown;
    blurred_code(layout, word, taps, shown);
    double sum = 0, shown_squares = 0, product = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += shown[i];
      shown_squares += shown[i] * shown[i];
      product += value[i] * shown[i];
    }
    const double about_mean = shown_squares - sum * sum / static_cast<double>(n);
    return product > 0 && about_mean > 0 && squares > 0 ? product * product / (about_mean * squares) : 0;
  }

  // Likeness under the blur that suits the word best, and that blur.
  double best_likeness(const Layout& layout, const Reading& reading, u64 word, BlurTaps& taps) const {
    double best = 0;
    for (const double sigma_px : kTriedBlur_px) {
      const BlurTaps tried = blur_taps(reading, sigma_px);
      const double like = likeness(layout, word, tried);
      if (like <= best) continue;
      best = like;
      taps = tried;
    }
    return best;
  }
};

u64 signs(const Levels& levels, std::size_t n) {
  u64 word = 0;
  for (std::size_t i = 0; i < n; ++i) word |= static_cast<u64>(levels[i] > 0) << i;
  return word;
}

// Words that are looked through one by one for near ones: a few microseconds' worth.
constexpr std::size_t kMaxNearScan = 20000;

// Whether any word with at most `distance` bits other than `seen` is likely; true without a look at a longer list. What
// match_levels accepts is such a word, so this only saves it the work on patterns that are no codes.
template <class Likely>
bool any_likely(const std::vector<u64>& words, u64 seen, int distance, const Likely& likely) {
  if (words.size() > kMaxNearScan) return true;
  constexpr std::size_t kBlock = 64;
  for (std::size_t begin = 0; begin < words.size(); begin += kBlock) {
    const std::size_t size = std::min(kBlock, words.size() - begin);
    for (u64 near = near_words(&words[begin], size, seen, distance); near != 0; near &= near - 1) {
      if (likely(words[begin + static_cast<std::size_t>(__builtin_ctzll(near))])) return true;
    }
  }
  return false;
}

}  // namespace

CodeMatcher::CodeMatcher(const MarkerFamily& family, const Layout& layout, int max_hamming)
    : book_(family, layout, allowed_hamming(family, max_hamming)),
      bits_likeness_(likeness_of_bits(book_.bits(), book_.words().size(), correctable_bits(family))),
      levels_likeness_(likeness_for(book_.bits(), book_.words().size(), kLevelsLikeChance)),
      least_evidence_(static_cast<double>(book_.words().size()) / kEvidenceChance),
      correctable_(correctable_bits(family)),
      levels_allowed_(book_.max_hamming() > 0) {}

CodeMatch CodeMatcher::match_bits(const Layout& layout, const Reading& reading) const {
  Levels sharp;
  sharpen(layout, reading, blur_taps(reading, kUsualBlur_px), sharp);
  const CodeBook::Match found = book_.find(signs(sharp, layout.x.size()));
  CodeMatch match;
  if (found.entry < 0) return match;
  BlurTaps taps;
  const Centred centred(reading, layout.x.size());
  match.likeness = centred.best_likeness(layout, reading, book_.words()[found.entry], taps);
  if (match.likeness < bits_likeness_) return match;
  match.entry = found.entry;
  match.hamming = found.hamming;
  return match;
}

CodeMatch CodeMatcher::match_levels(const Layout& layout, const Reading& reading) const {
  CodeMatch none;
  if (!levels_allowed_ || reading.module_area_px2 < kLeastModule_px2) return none;
  const std::size_t n = layout.x.size();
  const Centred centred(reading, n);

  Levels sharp;
  sharpen(layout, reading, blur_taps(reading, kUsualBlur_px), sharp);
  const u64 seen = signs(sharp, n);
  if (!any_likely(book_.words(), seen, correctable_, [&](u64 word) {
        BlurTaps taps;
        return centred.best_likeness(layout, reading, word, taps) >= levels_likeness_;
      })) {
    return none;
  }
  const ShortList list = likely_words(book_, sharp, reading.half_contrast);

  CodeMatch best;
  double rival = 0;
  BlurTaps taps;
  for (int i = 0; i < list.size; ++i) {
    const u64 word = book_.words()[list.entry[i]];
    // The blur is the image's, not the code's: what suits the likeliest word is kept for the others.
    const double like =
        i == 0 ? centred.best_likeness(layout, reading, word, taps) : centred.likeness(layout, word, taps);
    if (like > best.likeness) {
      rival = best.likeness;
      best.likeness = like;
      best.entry = list.entry[i];
    } else if (like > rival) {
      rival = like;
    }
  }
  if (best.entry < 0 || best.likeness < levels_likeness_) return none;
  // Likelihoods of Gaussian noise of unknown size: (rest of the rival / rest of the best)^n.
  const double ratio = (1 - rival) / std::max(1 - best.likeness, 1e-9);
  if (power(ratio, static_cast<int>(n)) < kRivalOdds) return none;
  if (evidence_against_chance(layout, reading, book_.words()[best.entry], taps) < least_evidence_) return none;
  best.hamming = count_bits(seen ^ book_.words()[best.entry]);
  // A second guard beside the evidence: no more wrong bits than the family's distance corrects. Two more would
  // find 97.2 % of small markers in place of 96.3, and took clutter for tag36h11 eleven times in a million frames.
  if (best.hamming > correctable_) return none;
  return best;
}

}  // namespace berth
