#include "adapters/ensemble/toml_table.hpp"

#include "adapters/ensemble/suggestion.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

namespace lbea::io {
namespace {

template <class T>
std::optional<T> as(const toml::node& node);

template <>
std::optional<bool> as(const toml::node& node) {
  return node.value_exact<bool>();
}

template <>
std::optional<std::string> as(const toml::node& node) {
  return node.value_exact<std::string>();
}

template <>
std::optional<double> as(const toml::node& node) {
  const auto value = node.is_boolean() ? std::nullopt : node.value<double>();
  return value && std::isfinite(*value) ? value : std::nullopt;
}

template <>
std::optional<std::uint32_t> as(const toml::node& node) {
  const auto value = node.value_exact<std::int64_t>();
  if (!value || *value < 0 || *value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(*value);
}

std::string type_of(const toml::node& node) {
  std::ostringstream text;
  text << node.type();
  return text.str();
}

constexpr const char* a_count = "a whole number from 0 to 4294967295";

}  // namespace

TomlTable::TomlTable(const toml::table& table, const std::filesystem::path& file, std::string prefix)
    : table_(table), file_(file), prefix_(std::move(prefix)) {}

const toml::node* TomlTable::find(const char* key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  return table_.get(key);
}

template <class T>
void TomlTable::read_one(const char* key, T& into, const char* expected) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const auto value = as<T>(*node);
  if (!value) fail(key, std::string("needs ") + expected + ", not this " + type_of(*node));
  into = *value;
}

template <class T>
void TomlTable::read_list(const char* key, std::vector<T>& into, const char* expected) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (!node->is_array()) fail(key, std::string("needs a list of ") + expected + ", not " + type_of(*node));
  std::vector<T> values;
  for (const toml::node& item : *node->as_array()) {
    const auto value = as<T>(item);
    if (!value)
      fail_at(item.source(), "\"" + prefix_ + key + "\" needs a list of " + expected + ", but one is " + type_of(item));
    values.push_back(*value);
  }
  into = std::move(values);
}

void TomlTable::read(const char* key, bool& into) { read_one(key, into, "true or false"); }
void TomlTable::read(const char* key, double& into) { read_one(key, into, "a finite number"); }
void TomlTable::read(const char* key, std::uint32_t& into) { read_one(key, into, a_count); }
void TomlTable::read(const char* key, std::string& into) { read_one(key, into, "text in quotes"); }
void TomlTable::read(const char* key, std::vector<std::string>& into) { read_list(key, into, "texts in quotes"); }
void TomlTable::read(const char* key, std::vector<std::uint32_t>& into) {
  read_list(key, into, "whole numbers from 0 to 4294967295");
}

void TomlTable::read(const char* key, std::array<double, 3>& into) {
  std::vector<double> values;
  read_list(key, values, "three finite numbers");
  if (!table_.contains(key)) return;
  if (values.size() != 3) fail(key, "needs three finite numbers");
  std::copy(values.begin(), values.end(), into.begin());
}

void TomlTable::read_path(const char* key, std::filesystem::path& into) {
  std::string text;
  read(key, text);
  if (!table_.contains(key)) return;
  if (text.empty()) fail(key, "is empty");
  into = (folder() / text).lexically_normal();
}

std::unique_ptr<TomlTable> TomlTable::table(const char* key) {
  const toml::node* node = find(key);
  if (node == nullptr) return nullptr;
  if (!node->is_table()) fail(key, "needs a table, not " + type_of(*node));
  return std::make_unique<TomlTable>(*node->as_table(), file_, prefix_ + key + ".");
}

void TomlTable::refuse_unknown_keys() const {
  for (const auto& [key, node] : table_)
    if (std::find(known_.begin(), known_.end(), key.str()) == known_.end())
      fail_at(key.source(), "unknown key \"" + prefix_ + std::string(key.str()) + "\"" + suggestion(key.str(), known_));
}

void TomlTable::fail(const char* key, const std::string& what) const {
  const toml::node* node = table_.get(key);
  fail_at(node != nullptr ? node->source() : table_.source(), "\"" + prefix_ + key + "\" " + what);
}

void TomlTable::fail_at(const toml::source_region& where, const std::string& what) const {
  throw Error(Status::bad_input, file_.string() + ", line " + std::to_string(where.begin.line) + ": " + what);
}

}  // namespace lbea::io
