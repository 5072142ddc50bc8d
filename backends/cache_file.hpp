#pragma once

#include <string>
#include <vector>

namespace berth {

using CacheBytes = std::vector<unsigned char>;

/// `chosen`, or $XDG_CACHE_HOME/berth, or $HOME/.cache/berth; empty when none of them is set.
std::string cache_folder(const std::string& chosen);

// Files that hold a magic text, the CRC-32 of all that follows (little-endian) and then the content. Nothing in them is
// needed: what cannot be read is as good as absent, what cannot be written is not kept, and neither throws.

/// The content, empty when there is none or the file is damaged.
CacheBytes read_cache_file(const std::string& path, const std::string& magic);
/// Writes `path` in `folder`, which is made, in one step for other processes. Returns false when that was not possible.
bool write_cache_file(const std::string& folder, const std::string& path, const std::string& magic,
                      const CacheBytes& content);

}  // namespace berth
