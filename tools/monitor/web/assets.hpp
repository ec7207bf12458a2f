// The page's files: inside this program, or in a folder while they are being worked on.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace lbea::tool {

struct EmbeddedAsset {
  std::string_view name, bytes;
};
/// Written by the build.
[[nodiscard]] std::span<const EmbeddedAsset> embedded_assets() noexcept;

struct Asset {
  std::string_view content_type;
  std::string bytes;
};

class Assets {
 public:
  /// `folder`: looked into at every request; empty: what is embedded.
  explicit Assets(std::filesystem::path folder = {}) : folder_(std::move(folder)) {}
  /// `path` as in a request: "/" is the page itself. Only plain names of known kinds are found.
  [[nodiscard]] std::optional<Asset> find(std::string_view path) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace lbea::tool
