#include "health/memory_scrub.hpp"

#ifdef __linux__
#include <link.h>
#endif

#include <algorithm>

#include "crc32.hpp"

namespace berth {
namespace {

constexpr std::size_t kPiece = 4096;

}  // namespace

void MemoryScrub::add(const std::vector<ConstantMemory>& blocks, int owner) {
  for (const ConstantMemory& block : blocks) {
    const auto* at = static_cast<const unsigned char*>(block.data);
    for (std::size_t done = 0; done < block.bytes; done += kPiece) {
      const std::size_t count = std::min(kPiece, block.bytes - done);
      pieces_.push_back({at + done, count, crc32(at + done, count), block.what, owner});
    }
    bytes_ += block.bytes;
  }
}

std::optional<MemoryScrub::Altered> MemoryScrub::check_next(std::size_t& done) {
  const Piece& piece = pieces_[next_];
  next_ = next_ + 1 < pieces_.size() ? next_ + 1 : 0;
  done += piece.bytes;
  checked_ += piece.bytes;
  if (crc32(piece.at, piece.bytes) == piece.crc) return std::nullopt;
  return Altered{piece.what, piece.owner};
}

std::optional<MemoryScrub::Altered> MemoryScrub::check(std::size_t bytes) {
  std::size_t done = 0;
  // Once around at most: small blocks must not be checked twice for a large slice.
  for (std::size_t looked = 0; looked < pieces_.size() && done < bytes; ++looked) {
    if (const std::optional<Altered> found = check_next(done)) return found;
  }
  return std::nullopt;
}

std::optional<MemoryScrub::Altered> MemoryScrub::check_on(std::size_t bytes, std::size_t& done) {
  while (!pieces_.empty() && done < bytes) {
    if (const std::optional<Altered> found = check_next(done)) return found;
    if (next_ == 0) break;
  }
  return std::nullopt;
}

#ifdef __linux__

namespace {

// AddressSanitizer has something forbidden to read behind every table.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define BERTH_TABLES_ARE_GUARDED 1
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define BERTH_TABLES_ARE_GUARDED 1
#endif
#ifdef BERTH_TABLES_ARE_GUARDED
constexpr bool kTablesAreGuarded = true;
#else
constexpr bool kTablesAreGuarded = false;
#endif

/// Adds the segments that cannot be written of the module this function is in.
int add_own_segments(dl_phdr_info* info, std::size_t, void* to) {
  const auto here = reinterpret_cast<ElfW(Addr)>(&add_own_segments);
  const auto segments = [&](auto&& each) {
    for (int i = 0; i < info->dlpi_phnum; ++i) {
      const ElfW(Phdr)& segment = info->dlpi_phdr[i];
      if (segment.p_type == PT_LOAD) each(segment, info->dlpi_addr + segment.p_vaddr);
    }
  };
  bool is_own = false;
  segments([&](const ElfW(Phdr) & segment, ElfW(Addr) at) {
    is_own = is_own || (here >= at && here - at < segment.p_memsz);
  });
  if (!is_own) return 0;
  segments([&](const ElfW(Phdr) & segment, ElfW(Addr) at) {
    const bool is_readable = (segment.p_flags & PF_R) != 0 && (segment.p_flags & PF_W) == 0;
    const bool is_code = (segment.p_flags & PF_X) != 0;
    if (!is_readable || (kTablesAreGuarded && !is_code)) return;
    auto& memory = *static_cast<std::vector<ConstantMemory>*>(to);
    memory.push_back(
        {is_code ? "program code" : "program tables", reinterpret_cast<const void*>(at), segment.p_filesz});
  });
  return 1;
}

}  // namespace

std::vector<ConstantMemory> program_memory() {
  std::vector<ConstantMemory> memory;
  dl_iterate_phdr(add_own_segments, &memory);
  return memory;
}

#else

std::vector<ConstantMemory> program_memory() { return {}; }

#endif

}  // namespace berth
