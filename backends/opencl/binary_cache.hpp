#pragma once

#include <string>
#include <vector>

#include "berth/types.hpp"

namespace berth::opencl {

/// A folder of compiled programs. Nothing in it is needed: what cannot be read is as good as absent, what cannot be
/// written is not kept, and no function throws.
///
/// A file is named after a hash of its identity (device, driver, build options, source) and holds
///   "berth opencl 1\n"  CRC-32 of all that follows  bytes of the identity (u32 each, little-endian)  identity  binary
class BinaryCache {
 public:
  /// `folder` is made when it is first written to; empty switches the cache off.
  explicit BinaryCache(std::string folder) : folder_(std::move(folder)) {}

  const std::string& folder() const { return folder_; }
  /// Where the binary of that identity is or would be.
  std::string path_of(const std::string& identity) const;

  /// The binary kept for that identity, empty when there is none or the file is damaged.
  std::vector<unsigned char> load(const std::string& identity) const;
  /// Keeps it, in one step for other processes. Returns false when that was not possible.
  bool store(const std::string& identity, const std::vector<unsigned char>& binary) const;

 private:
  std::string folder_;
};

/// `chosen`, or $XDG_CACHE_HOME/berth, or $HOME/.cache/berth; empty when none of them is set.
std::string cache_folder(const std::string& chosen);

/// CRC-32 (polynomial 0xEDB88320, as in zlib).
u32 crc32(const unsigned char* bytes, std::size_t count);

/// 128 bits of a text in hexadecimal: FNV-1a and FNV-1, 64 bits each.
std::string hash_hex(const std::string& text);

}  // namespace berth::opencl
