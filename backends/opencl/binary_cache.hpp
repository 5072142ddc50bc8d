#pragma once

#include <string>

#include "cache_file.hpp"

namespace berth::opencl {

/// A folder of compiled programs. Nothing in it is needed: what cannot be read is as good as absent, what cannot be
/// written is not kept, and no function throws.
///
/// A cache file (cache_file.hpp) is named after a hash of its identity (device, driver, build options, source) and
/// holds
///   "berth opencl 1\n"  CRC-32  bytes of the identity (u32, little-endian)  identity  binary
class BinaryCache {
 public:
  /// `folder` is made when it is first written to; empty switches the cache off.
  explicit BinaryCache(std::string folder) : folder_(std::move(folder)) {}

  const std::string& folder() const { return folder_; }
  /// Where the binary of that identity is or would be.
  std::string path_of(const std::string& identity) const;

  /// The binary kept for that identity, empty when there is none or the file is damaged.
  CacheBytes load(const std::string& identity) const;
  /// Keeps it, in one step for other processes. Returns false when that was not possible.
  bool store(const std::string& identity, const CacheBytes& binary) const;

 private:
  std::string folder_;
};

/// 128 bits of a text in hexadecimal: FNV-1a and FNV-1, 64 bits each.
std::string hash_hex(const std::string& text);

}  // namespace berth::opencl
