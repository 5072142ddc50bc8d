#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace berth::cli {

/// A file of tools/web, or of the libraries that the page uses, as it was when Berth was built.
struct WebAsset {
  std::string name;
  /// For Content-Type.
  const char* type;
  std::string_view bytes;
  /// Handed out by the server; the others are parts of a report.
  bool is_served;
};

/// tools/web/CMakeLists.txt lists them.
const std::vector<WebAsset>& web_assets();
/// The bytes of the one of that name.
std::string_view web_asset(const std::string& name);

}  // namespace berth::cli
