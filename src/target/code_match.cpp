#include "target/code_match.hpp"

#include <algorithm>
#include <array>

#include "target/blur.hpp"

namespace berth {
namespace {

using Levels = std::array<double, kMaxCells>;

// Chances that a pattern which is no marker is taken for one, per quadrilateral whose border looked right.
constexpr double kWrongBitsChance = 2e-4;   // by the number of wrong bits alone
constexpr double kBitsLikeChance = 1e-3;    // bits right, levels like noise
constexpr double kLevelsLikeChance = 1e-5;  // levels alone
// How much likelier (squared) the best code must be than the next.
constexpr double kRivalOdds = 1e6;

// Lens blur supposed before anything is known, and the ones tried on a candidate, px.
constexpr double kUsualBlur_px = 0.8;
constexpr double kTriedBlur_px[] = {0.5, 1.0, 1.6};

// Candidates by sharpened levels that are compared in full.
constexpr int kShortList = 12;

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

int allowed_hamming(const MarkerFamily& family, int max_hamming) {
  const int correctable = std::max(0, (family.min_hamming - 1) / 2);
  return safe_hamming(static_cast<int>(family.bit_x.size()), 4 * family.codes.size(),
                      std::min(max_hamming, correctable));
}

double squared_correlation(const Levels& a, const Levels& b, std::size_t n) {
  double mean_a = 0, mean_b = 0;
  for (std::size_t i = 0; i < n; ++i) {
    mean_a += a[i];
    mean_b += b[i];
  }
  mean_a /= static_cast<double>(n);
  mean_b /= static_cast<double>(n);
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double da = a[i] - mean_a, db = b[i] - mean_b;
    aa += da * da;
    bb += db * db;
    ab += da * db;
  }
  return ab > 0 && aa > 0 && bb > 0 ? ab * ab / (aa * bb) : 0;
}

// Likeness of a word under the blur that suits it best.
double likeness(const Layout& layout, const Reading& reading, u64 word) {
  double best = 0;
  for (const double sigma_px : kTriedBlur_px) {
    Levels shown;
    blurred_code(layout, word, blur_taps(reading, sigma_px), shown);
    best = std::max(best, squared_correlation(reading.value, shown, layout.x.size()));
  }
  return best;
}

u64 signs(const Levels& levels, std::size_t n) {
  u64 word = 0;
  for (std::size_t i = 0; i < n; ++i) word |= static_cast<u64>(levels[i] > 0) << i;
  return word;
}

}  // namespace

CodeMatcher::CodeMatcher(const MarkerFamily& family, const Layout& layout, int max_hamming)
    : book_(family, layout, allowed_hamming(family, max_hamming)),
      bits_likeness_(likeness_for(book_.bits(), book_.words().size(), kBitsLikeChance)),
      levels_likeness_(likeness_for(book_.bits(), book_.words().size(), kLevelsLikeChance)),
      levels_allowed_(book_.max_hamming() > 0) {}

CodeMatch CodeMatcher::match_bits(const Layout& layout, const Reading& reading) const {
  Levels sharp;
  sharpen(layout, reading, blur_taps(reading, kUsualBlur_px), sharp);
  const CodeBook::Match found = book_.find(signs(sharp, layout.x.size()));
  CodeMatch match;
  if (found.entry < 0) return match;
  match.likeness = likeness(layout, reading, book_.words()[found.entry]);
  if (match.likeness < bits_likeness_) return match;
  match.entry = found.entry;
  match.hamming = found.hamming;
  return match;
}

CodeMatch CodeMatcher::match_levels(const Layout& layout, const Reading& reading) const {
  CodeMatch none;
  if (!levels_allowed_) return none;
  const std::size_t n = layout.x.size();
  Levels sharp;
  sharpen(layout, reading, blur_taps(reading, kUsualBlur_px), sharp);

  // Sum of the levels' agreement with every word, a byte of the word at a time.
  constexpr int kBytes = kMaxCells / 8;
  std::array<std::array<s32, 256>, kBytes> agreement;
  const int bytes = static_cast<int>(n + 7) / 8;
  for (int byte = 0; byte < bytes; ++byte) {
    s32 level[8];
    s32 sum = 0;
    for (int k = 0; k < 8; ++k) {
      const std::size_t i = static_cast<std::size_t>(8 * byte + k);
      // One glaring cell must not outvote the others.
      const double limited = i < n ? std::min(1.5, std::max(-1.5, sharp[i] / reading.half_contrast)) : 0.0;
      level[k] = static_cast<s32>(limited * 4096);
      sum -= level[k];
    }
    agreement[byte][0] = sum;
    for (int v = 1; v < 256; ++v) {
      const int lowest = v & -v;
      int k = 0;
      while ((1 << k) != lowest) ++k;
      agreement[byte][v] = agreement[byte][v ^ lowest] + 2 * level[k];
    }
  }

  struct Candidate {
    s32 score;
    int entry;
  };
  std::array<Candidate, kShortList> list;
  int listed = 0;
  const std::vector<u64>& words = book_.words();
  s32 least = INT32_MIN;
  for (std::size_t e = 0; e < words.size(); ++e) {
    s32 score = 0;
    for (int byte = 0; byte < bytes; ++byte) score += agreement[byte][(words[e] >> (8 * byte)) & 255];
    if (score <= least) continue;
    int at = listed < kShortList ? listed++ : kShortList - 1;
    for (; at > 0 && list[at - 1].score < score; --at) list[at] = list[at - 1];
    list[at] = {score, static_cast<int>(e)};
    if (listed == kShortList) least = list[kShortList - 1].score;
  }

  CodeMatch best;
  double rival = 0;
  for (int i = 0; i < listed; ++i) {
    const double like = likeness(layout, reading, words[list[i].entry]);
    if (like > best.likeness) {
      rival = best.likeness;
      best.likeness = like;
      best.entry = list[i].entry;
    } else if (like > rival) {
      rival = like;
    }
  }
  if (best.entry < 0 || best.likeness < levels_likeness_) return none;
  // Likelihoods of Gaussian noise of unknown size: (rest of the rival / rest of the best)^n.
  const double ratio = (1 - rival) / std::max(1 - best.likeness, 1e-9);
  if (power(ratio, static_cast<int>(n)) < kRivalOdds) return none;
  best.hamming = count_bits(signs(sharp, n) ^ words[best.entry]);
  return best;
}

}  // namespace berth
