#include "opencl/binary_cache.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "little_endian.hpp"

namespace berth::opencl {
namespace {

const std::string kMagic = "berth opencl 1\n";

}  // namespace

std::string BinaryCache::path_of(const std::string& identity) const {
  return folder_ + "/" + hash_hex(identity) + ".clbin";
}

CacheBytes BinaryCache::load(const std::string& identity) const {
  if (folder_.empty()) return {};
  const CacheBytes content = read_cache_file(path_of(identity), kMagic);
  if (content.size() < 4 + identity.size() || read_le32(content.data()) != identity.size() ||
      std::memcmp(content.data() + 4, identity.data(), identity.size()) != 0) {
    return {};
  }
  return {content.data() + 4 + identity.size(), content.data() + content.size()};
}

bool BinaryCache::store(const std::string& identity, const CacheBytes& binary) const {
  if (folder_.empty() || binary.empty()) return false;
  CacheBytes content(4 + identity.size() + binary.size());
  write_le32(content.data(), static_cast<u32>(identity.size()));
  const auto after_identity = std::copy(identity.begin(), identity.end(), content.begin() + 4);
  std::copy(binary.begin(), binary.end(), after_identity);
  return write_cache_file(folder_, path_of(identity), kMagic, content);
}

std::string hash_hex(const std::string& text) {
  constexpr u64 kPrime = 0x100000001b3u;
  u64 before = 0xcbf29ce484222325u;  // FNV-1a: xor, then multiply
  u64 after = 0xcbf29ce484222325u;   // FNV-1: multiply, then xor
  for (const char c : text) {
    const u64 byte = static_cast<unsigned char>(c);
    before = (before ^ byte) * kPrime;
    after = (after * kPrime) ^ byte;
  }
  char hex[33];
  std::snprintf(hex, sizeof hex, "%016llx%016llx", static_cast<unsigned long long>(before),
                static_cast<unsigned long long>(after));
  return hex;
}

}  // namespace berth::opencl
