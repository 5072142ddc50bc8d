#include "opencl/binary_cache.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace berth::opencl {
namespace {

const std::string kMagic = "berth opencl 1\n";
constexpr std::size_t kHeaderBytes = 15 + 8;
/// Above any real program; a damaged length must not allocate the machine's memory.
constexpr long kMaxFileBytes = 1L << 28;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

void append_u32(std::vector<unsigned char>& bytes, u32 value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<unsigned char>(value >> shift));
}

u32 read_u32(const unsigned char* bytes) {
  u32 value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | bytes[i];
  return value;
}

std::vector<unsigned char> read_file(const std::string& path) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode) || info.st_size > kMaxFileBytes) return {};
  const File file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) return {};
  std::vector<unsigned char> bytes(static_cast<std::size_t>(info.st_size));
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  return bytes;
}

bool make_folders(const std::string& folder) {
  for (std::size_t end = folder.find('/', 1);; end = folder.find('/', end + 1)) {
    const std::string part = folder.substr(0, end);
    if (mkdir(part.c_str(), 0700) != 0 && errno != EEXIST && access(part.c_str(), F_OK) != 0) return false;
    if (end == std::string::npos) return true;
  }
}

/// A name of its own for each writer, made by the system.
bool write_file(const std::string& path, const std::vector<unsigned char>& bytes) {
  std::string temporary = path + ".XXXXXX";
  const int descriptor = mkstemp(&temporary[0]);
  if (descriptor < 0) return false;
  std::FILE* file = fdopen(descriptor, "wb");
  if (file == nullptr) {
    close(descriptor);
    unlink(temporary.c_str());
    return false;
  }
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const bool closed = std::fclose(file) == 0;
  if (written && closed && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  unlink(temporary.c_str());
  return false;
}

}  // namespace

std::string BinaryCache::path_of(const std::string& identity) const {
  return folder_ + "/" + hash_hex(identity) + ".clbin";
}

std::vector<unsigned char> BinaryCache::load(const std::string& identity) const {
  if (folder_.empty()) return {};
  const std::vector<unsigned char> bytes = read_file(path_of(identity));
  if (bytes.size() < kHeaderBytes + identity.size()) return {};
  const unsigned char* header = bytes.data() + kMagic.size();
  const unsigned char* checked = header + 4;
  if (std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0 ||
      read_u32(header) != crc32(checked, bytes.size() - kMagic.size() - 4) || read_u32(checked) != identity.size() ||
      std::memcmp(checked + 4, identity.data(), identity.size()) != 0) {
    return {};
  }
  return {checked + 4 + identity.size(), bytes.data() + bytes.size()};
}

bool BinaryCache::store(const std::string& identity, const std::vector<unsigned char>& binary) const {
  if (folder_.empty() || binary.empty() || !make_folders(folder_)) return false;
  std::vector<unsigned char> checked;
  append_u32(checked, static_cast<u32>(identity.size()));
  checked.insert(checked.end(), identity.begin(), identity.end());
  checked.insert(checked.end(), binary.begin(), binary.end());
  std::vector<unsigned char> bytes(kMagic.begin(), kMagic.end());
  append_u32(bytes, crc32(checked.data(), checked.size()));
  bytes.insert(bytes.end(), checked.begin(), checked.end());
  return write_file(path_of(identity), bytes);
}

std::string cache_folder(const std::string& chosen) {
  if (!chosen.empty()) return chosen;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  // The XDG specification: a relative path counts as unset.
  if (xdg != nullptr && xdg[0] == '/') return std::string(xdg) + "/berth";
  const char* home = std::getenv("HOME");
  return home != nullptr && home[0] != '\0' ? std::string(home) + "/.cache/berth" : "";
}

u32 crc32(const unsigned char* bytes, std::size_t count) {
  u32 table[256];
  for (u32 i = 0; i < 256; ++i) {
    u32 value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value & 1u) != 0 ? 0xedb88320u ^ (value >> 1) : value >> 1;
    table[i] = value;
  }
  u32 crc = 0xffffffffu;
  for (std::size_t i = 0; i < count; ++i) crc = table[(crc ^ bytes[i]) & 255u] ^ (crc >> 8);
  return ~crc;
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
