#include "target/code_book.hpp"

#include <algorithm>

namespace berth {
namespace {

// Enough values that a chunk of the largest family (195 000 words) has three codes a value, and small enough to stay in
// cache.
constexpr int kMaxChunkBits = 16;

}  // namespace

CodeBook::CodeBook(const MarkerFamily& family, const Layout& layout, int max_hamming)
    : family_(&family), bits_(static_cast<int>(family.bit_x.size())), max_hamming_(max_hamming) {
  const std::size_t n = family.bit_x.size();
  std::vector<int> cell(n);
  for (std::size_t i = 0; i < n; ++i) cell[i] = layout.cell_at(family.bit_x[i], family.bit_y[i]);

  words_.reserve(4 * family.codes.size());
  for (const u64 code : family.codes) {
    std::vector<std::size_t> place(n);  // where bit i is seen after the turns made so far
    for (std::size_t i = 0; i < n; ++i) place[i] = i;
    for (int turn = 0; turn < 4; ++turn) {
      u64 word = 0;
      for (std::size_t i = 0; i < n; ++i) word |= ((code >> (n - 1 - i)) & 1) << cell[place[i]];
      words_.push_back(word);
      for (std::size_t& p : place) p = static_cast<std::size_t>(family.rotation[p]);
    }
  }

  // With e wrong bits in e + 1 chunks one chunk is right: look only at the codes that share a chunk's value.
  const int count = max_hamming_ + 1;
  for (int c = 0; c < count; ++c) {
    const int from = bits_ * c / count;
    const int width = std::min(bits_ * (c + 1) / count - from, kMaxChunkBits);
    Chunk chunk;
    chunk.shift = from;
    chunk.mask = (u64{1} << width) - 1;
    chunk.first.assign(chunk.mask + 2, 0);
    for (const u64 word : words_) ++chunk.first[((word >> from) & chunk.mask) + 1];
    for (std::size_t v = 1; v < chunk.first.size(); ++v) chunk.first[v] += chunk.first[v - 1];
    std::vector<u32> next(chunk.first.begin(), chunk.first.end() - 1);
    chunk.entries.resize(words_.size());
    for (std::size_t e = 0; e < words_.size(); ++e) {
      chunk.entries[next[(words_[e] >> from) & chunk.mask]++] = static_cast<u32>(e);
    }
    chunks_.push_back(std::move(chunk));
  }
}

CodeBook::Match CodeBook::find(u64 word) const {
  Match best;
  best.hamming = max_hamming_ + 1;
  for (const Chunk& chunk : chunks_) {
    const u64 value = (word >> chunk.shift) & chunk.mask;
    for (u32 i = chunk.first[value]; i < chunk.first[value + 1]; ++i) {
      const int entry = static_cast<int>(chunk.entries[i]);
      const int hamming = count_bits(word ^ words_[chunk.entries[i]]);
      if (hamming > max_hamming_) continue;
      if (hamming < best.hamming || (hamming == best.hamming && entry < best.entry)) best = {entry, hamming};
    }
  }
  return best;
}

void CodeBook::list_constants(std::vector<ConstantMemory>& to) const {
  add_constants("code book", words_, to);
  add_constants("code book", chunks_, to);
  for (const Chunk& chunk : chunks_) {
    add_constants("code book", chunk.first, to);
    add_constants("code book", chunk.entries, to);
  }
}

}  // namespace berth
