#pragma once

#include <optional>
#include <vector>

#include "berth/constant_memory.hpp"
#include "berth/types.hpp"

namespace berth {

/// Checks memory that nobody writes against the CRC-32 that it had at start, a piece at a time. Nothing is written in
/// it, and nothing allocated once all is added.
class MemoryScrub {
 public:
  /// Whose memory that is which every backend uses.
  static constexpr int kShared = -1;
  struct Altered {
    const char* what;
    int owner;
  };

  /// Takes the checksums as they are now.
  void add(const std::vector<ConstantMemory>& blocks, int owner);
  /// Goes on where it stopped, round and round, for `bytes` at least. The first piece that differs ends it.
  std::optional<Altered> check(std::size_t bytes);
  /// The same as long as `done` is less, and no further than to the end; adds to `done` what was checked.
  std::optional<Altered> check_on(std::size_t bytes, std::size_t& done);
  /// Whether the next piece is the first.
  bool is_at_start() const { return next_ == 0; }

  std::size_t bytes() const { return bytes_; }
  /// All that was checked so far.
  u64 checked() const { return checked_; }

 private:
  std::optional<Altered> check_next(std::size_t& done);

  struct Piece {
    const unsigned char* at;
    std::size_t bytes;
    u32 crc;
    const char* what;
    int owner;
  };
  std::vector<Piece> pieces_;
  std::size_t next_ = 0, bytes_ = 0;
  u64 checked_ = 0;
};

/// The code and the constant tables of the module that this is linked into, where the system tells: kernels of the CPU
/// backends among them.
std::vector<ConstantMemory> program_memory();

}  // namespace berth
