#include "cache_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "crc32.hpp"
#include "little_endian.hpp"

namespace berth {
namespace {

/// Above any real content; a wrong file must not fill the machine's memory.
constexpr long kMaxFileBytes = 1L << 28;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

CacheBytes read_file(const std::string& path) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode) || info.st_size > kMaxFileBytes) return {};
  const File file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) return {};
  CacheBytes bytes(static_cast<std::size_t>(info.st_size));
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
bool write_file(const std::string& path, const CacheBytes& bytes) {
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

std::string cache_folder(const std::string& chosen) {
  if (!chosen.empty()) return chosen;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  // The XDG specification: a relative path counts as unset.
  if (xdg != nullptr && xdg[0] == '/') return std::string(xdg) + "/berth";
  const char* home = std::getenv("HOME");
  return home != nullptr && home[0] != '\0' ? std::string(home) + "/.cache/berth" : "";
}

CacheBytes read_cache_file(const std::string& path, const std::string& magic) {
  const CacheBytes bytes = read_file(path);
  const std::size_t header = magic.size() + 4;
  if (bytes.size() < header || std::memcmp(bytes.data(), magic.data(), magic.size()) != 0) return {};
  const unsigned char* content = bytes.data() + header;
  const std::size_t size = bytes.size() - header;
  if (read_le32(bytes.data() + magic.size()) != crc32(content, size)) return {};
  return {content, content + size};
}

bool write_cache_file(const std::string& folder, const std::string& path, const std::string& magic,
                      const CacheBytes& content) {
  if (!make_folders(folder)) return false;
  CacheBytes bytes(magic.begin(), magic.end());
  append_le32(bytes, crc32(content.data(), content.size()));
  bytes.insert(bytes.end(), content.begin(), content.end());
  return write_file(path, bytes);
}

}  // namespace berth
