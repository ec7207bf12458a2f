// JSON, written: enough for a model's provenance.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::bake {

[[nodiscard]] std::string json_string(std::string_view text);
/// The shortest text that reads back as the same number; null for what is not finite.
[[nodiscard]] std::string json_number(double number);
[[nodiscard]] std::string json_array(const std::vector<std::string>& values);

/// {"key": value, ...} in the order of the calls; values are JSON themselves.
class JsonObject {
 public:
  JsonObject& add(std::string_view key, const std::string& value);
  [[nodiscard]] std::string text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

}  // namespace lbea::bake
