#include "adapters/ensemble/toml_table.hpp"

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <sstream>

namespace lbea::io {
namespace {
template <class T>
std::optional<T> as(const toml::node& node) {
  if constexpr (std::is_same_v<T, double>) {
    const auto value = node.is_boolean() ? std::nullopt : node.value<double>();
    return value && std::isfinite(*value) ? value : std::nullopt;
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    const auto value = node.value_exact<std::int64_t>();
    if (!value || *value < 0 || *value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
    return static_cast<std::uint32_t>(*value);
  } else {
    return node.value_exact<T>();
  }
}

std::string type_of(const toml::node& node) {
  std::ostringstream text;
  text << node.type();
  return text.str();
}

/// Line of a key with more dots than anyone writes: toml++ 3.3 recurses for each of them and overruns the stack.
std::optional<std::size_t> line_of_deep_key(std::string_view text) {
  constexpr std::size_t most_dots = 1'000;
  std::size_t line = 1, dots = 0;
  for (const char c : text) {
    const bool is_of_key = std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                           std::string_view("_-\"' \t").find(c) != std::string_view::npos;
    dots = c == '.' ? dots + 1 : is_of_key ? dots : 0;
    if (dots > most_dots) return line;
    line += c == '\n' ? 1 : 0;
  }
  return {};
}
}  // namespace

struct TomlTable::Node {
  std::shared_ptr<const toml::table> file_table;  // owns all tables of the file
  const toml::table* table;
  std::filesystem::path file;
  std::string prefix;  // stands before the keys in messages: "region."
  std::vector<std::string> known;

  const toml::node* find(const char* key) {
    if (std::find(known.begin(), known.end(), key) == known.end()) known.emplace_back(key);
    return table->get(key);
  }

  template <class T>
  void read_one(const char* key, T& into, const char* expected) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto value = as<T>(*node);
    if (!value) fail(key, std::string("needs ") + expected + ", not this " + type_of(*node));
    into = *value;
  }

  template <class T>
  void read_list(const char* key, std::vector<T>& into, const char* expected) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    if (!node->is_array()) fail(key, std::string("needs a list of ") + expected + ", not " + type_of(*node));
    std::vector<T> values;
    for (const toml::node& item : *node->as_array()) {
      const auto value = as<T>(item);
      if (!value)
        fail_at(item.source(),
                "\"" + prefix + key + "\" needs a list of " + expected + ", but one is " + type_of(item));
      values.push_back(*value);
    }
    into = std::move(values);
  }

  [[noreturn]] void fail(const char* key, const std::string& what) const {
    const toml::node* node = table->get(key);
    fail_at(node != nullptr ? node->source() : table->source(), "\"" + prefix + key + "\" " + what);
  }

  [[noreturn]] void fail_at(const toml::source_region& where, const std::string& what) const {
    throw Error(Status::bad_input, file.string() + ", line " + std::to_string(where.begin.line) + ": " + what);
  }
};

TomlTable::TomlTable(Node node) : node_(std::make_unique<Node>(std::move(node))) {}
TomlTable::~TomlTable() = default;
TomlTable::TomlTable(TomlTable&&) noexcept = default;

TomlTable::TomlTable(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (const auto line = line_of_deep_key(as_text(bytes)))
    throw Error(Status::bad_input, file.string() + ", line " + std::to_string(*line) + ": a key with too many dots");
  try {
    auto table = std::make_shared<const toml::table>(toml::parse(as_text(bytes)));
    node_ = std::make_unique<Node>(Node{table, table.get(), file, "", {}});
  } catch (const toml::parse_error& error) {
    throw Error(Status::bad_input, file.string() + ", line " + std::to_string(error.source().begin.line) + ": " +
                                       std::string(error.description()));
  }
}

void TomlTable::read(const char* key, bool& into) { node_->read_one(key, into, "true or false"); }
void TomlTable::read(const char* key, double& into) { node_->read_one(key, into, "a finite number"); }
void TomlTable::read(const char* key, std::uint32_t& into) {
  node_->read_one(key, into, "a whole number from 0 to 4294967295");
}
void TomlTable::read(const char* key, std::string& into) { node_->read_one(key, into, "text in quotes"); }
void TomlTable::read(const char* key, std::vector<std::string>& into) {
  node_->read_list(key, into, "texts in quotes");
}
void TomlTable::read(const char* key, std::vector<std::uint32_t>& into) {
  node_->read_list(key, into, "whole numbers from 0 to 4294967295");
}

void TomlTable::read(const char* key, std::array<double, 3>& into) {
  if (!has(key)) return;
  std::vector<double> values;
  node_->read_list(key, values, "three finite numbers");
  if (values.size() != 3) fail(key, "needs three finite numbers");
  std::copy(values.begin(), values.end(), into.begin());
}

void TomlTable::read(const char* key, std::vector<std::array<std::uint32_t, 2>>& into) {
  const toml::node* node = node_->find(key);
  if (node == nullptr) return;
  const std::string expected = "needs a table of whole numbers from 0 to 4294967295, like {101 = 1, 102 = 2}";
  if (!node->is_table()) fail(key, expected + ", not " + type_of(*node));
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (const auto& [name, value] : *node->as_table()) {
    std::uint32_t number = 0;
    const std::string_view digits = name.str();
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    const auto second = as<std::uint32_t>(value);
    if (error != std::errc{} || end != digits.data() + digits.size() || !second) fail(key, expected);
    pairs.push_back({number, *second});
  }
  into = std::move(pairs);
}

void TomlTable::read(const char* key, std::vector<NumberOrPlace>& into) {
  const toml::node* node = node_->find(key);
  if (node == nullptr) return;
  const std::string expected = "needs a list of node numbers or places, like [4711] or [[0.5, 1, 2]]";
  if (!node->is_array()) fail(key, expected + ", not " + type_of(*node));
  std::vector<NumberOrPlace> values;
  for (const toml::node& item : *node->as_array()) {
    if (const auto number = as<std::uint32_t>(item)) {
      values.emplace_back(*number);
      continue;
    }
    const toml::array* place = item.as_array();
    if (place == nullptr || place->size() != 3) fail(key, expected);
    std::array<double, 3> numbers{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto number = as<double>((*place)[axis]);
      if (!number) fail(key, expected);
      numbers[axis] = *number;
    }
    values.emplace_back(numbers);
  }
  into = std::move(values);
}

void TomlTable::read_path(const char* key, std::filesystem::path& into) {
  if (!has(key)) return;
  std::string text;
  read(key, text);
  if (text.empty()) fail(key, "is empty");
  into = (folder() / text).lexically_normal();
}

bool TomlTable::has(const char* key) { return node_->find(key) != nullptr; }
bool TomlTable::is_list(const char* key) { return has(key) && node_->find(key)->is_array(); }
bool TomlTable::is_text(const char* key) { return has(key) && node_->find(key)->is_string(); }

std::unique_ptr<TomlTable> TomlTable::table(const char* key) {
  const toml::node* node = node_->find(key);
  if (node == nullptr) return nullptr;
  if (!node->is_table()) fail(key, "needs a table, not " + type_of(*node));
  return std::unique_ptr<TomlTable>(
      new TomlTable(Node{node_->file_table, node->as_table(), node_->file, node_->prefix + key + ".", {}}));
}

std::vector<TomlTable> TomlTable::tables(const char* key) {
  std::vector<TomlTable> tables;
  const toml::node* node = node_->find(key);
  if (node == nullptr) return tables;
  if (!node->is_array_of_tables()) fail(key, std::string("needs tables, each under [[") + key + "]]");
  for (const toml::node& item : *node->as_array())
    tables.push_back(TomlTable(Node{node_->file_table, item.as_table(), node_->file, node_->prefix + key + ".", {}}));
  return tables;
}

void TomlTable::refuse_unknown_keys() const {
  for (const auto& [key, node] : *node_->table)
    if (std::find(node_->known.begin(), node_->known.end(), key.str()) == node_->known.end())
      node_->fail_at(key.source(), "unknown key \"" + node_->prefix + std::string(key.str()) + "\"" +
                                       suggestion(key.str(), node_->known));
}

std::filesystem::path TomlTable::folder() const { return node_->file.parent_path(); }
void TomlTable::fail(const char* key, const std::string& what) const { node_->fail(key, what); }

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);  // distances of a's first i letters to every beginning of b
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::string suggestion(std::string_view word, std::span<const std::string> known) {
  const auto distance = [&](const std::string& other) { return edit_distance(word, other); };
  const auto nearest = std::min_element(known.begin(), known.end(),
                                        [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  if (nearest != known.end() && distance(*nearest) <= std::max<std::size_t>(2, word.size() / 3))
    return "; did you mean \"" + *nearest + "\"?";
  std::string list;
  for (const std::string& other : known) list += (list.empty() ? "" : ", ") + other;
  return "; known here: " + list;
}
}  // namespace lbea::io
