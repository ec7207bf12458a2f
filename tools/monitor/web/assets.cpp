#include "tools/monitor/web/assets.hpp"

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>

namespace lbea::tool {
namespace {

struct Kind {
  std::string_view ending, content_type;
};
constexpr std::array kinds{Kind{".html", "text/html; charset=utf-8"}, Kind{".js", "text/javascript; charset=utf-8"},
                           Kind{".css", "text/css; charset=utf-8"}, Kind{".svg", "image/svg+xml"}};

bool is_plain(std::string_view name) {
  constexpr std::string_view allowed = "abcdefghijklmnopqrstuvwxyz0123456789_-.";
  return !name.empty() && name.front() != '.' && name.find_first_not_of(allowed) == std::string_view::npos;
}

std::optional<std::string> bytes_of(std::string_view name, const std::filesystem::path& folder) {
  if (folder.empty()) {
    const auto assets = embedded_assets();
    const auto found = std::ranges::find(assets, name, &EmbeddedAsset::name);
    return found == assets.end() ? std::nullopt : std::optional(std::string(found->bytes));
  }
  try {
    return std::string(io::as_text(io::read_file(folder / name)));
  } catch (const Error&) { return {}; }
}

}  // namespace

std::optional<Asset> Assets::find(std::string_view path) const {
  std::string_view name = path.substr(std::min<std::size_t>(1, path.size()));
  if (name.empty()) name = "index.html";
  if (!is_plain(name)) return {};
  const auto kind = std::ranges::find_if(kinds, [&](const Kind& k) { return name.ends_with(k.ending); });
  if (kind == kinds.end()) return {};
  auto bytes = bytes_of(name, folder_);
  if (!bytes) return {};
  return Asset{kind->content_type, std::move(*bytes)};
}

}  // namespace lbea::tool
