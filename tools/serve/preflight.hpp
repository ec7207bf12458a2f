// Before the test, which happens once: everything that can be known to go wrong is said now.
#pragma once

#include "tools/serve/privileges.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lbea::tool {

struct Finding {
  enum class Level { ok, warning, failed };
  std::string name;
  Level level = Level::ok;
  std::string text;
};

/// Collects findings, one per question.
class Preflight {
 public:
  /// Asks `question`, whose answer becomes the finding's text; an exception makes it failed.
  void ask(const std::string& name, const std::function<std::string()>& question);
  void note(Finding finding) { findings_.push_back(std::move(finding)); }
  [[nodiscard]] const std::vector<Finding>& findings() const noexcept { return findings_; }
  /// Nothing failed; warnings do not count.
  [[nodiscard]] bool passed() const noexcept;
  [[nodiscard]] std::string to_text() const;
  [[nodiscard]] std::string to_json() const;

 private:
  std::vector<Finding> findings_;
};

/// Whether the clock that stamps are compared with is kept right, and cheap to read.
[[nodiscard]] std::vector<Finding> check_clock();
/// Room for `needed` bytes in what is free now.
[[nodiscard]] Finding check_memory(std::uint64_t needed);
/// Asks for each and gives it back with the thread it was asked for in.
[[nodiscard]] std::vector<Finding> check_privileges(const PrivilegeRequest& request, const Model* model, Method method);
/// Writes `bytes` to a file in `folder`, which is removed again: rate and longest stall, and what is free.
[[nodiscard]] Finding check_disk(const std::filesystem::path& folder, std::uint64_t bytes);

}  // namespace lbea::tool
