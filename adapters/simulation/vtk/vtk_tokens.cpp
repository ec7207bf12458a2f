#include "adapters/simulation/vtk/vtk_tokens.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <limits>

#include "adapters/files/ply_header.hpp"
#include "adapters/simulation/d3plot/d3plot_words.hpp"

namespace lbea::io::grid {
namespace {

bool is_space(char c) noexcept { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

struct NamedType {
  std::string_view name;
  NumberType number;
};
constexpr std::array types{NamedType{"unsigned_char", {1, false, false}},
                           NamedType{"char", {1, true, false}},
                           NamedType{"signed_char", {1, true, false}},
                           NamedType{"unsigned_short", {2, false, false}},
                           NamedType{"short", {2, true, false}},
                           NamedType{"unsigned_int", {4, false, false}},
                           NamedType{"int", {4, true, false}},
                           NamedType{"unsigned_long", {8, false, false}},
                           NamedType{"long", {8, true, false}},
                           NamedType{"vtktypeint64", {8, true, false}},
                           NamedType{"vtktypeuint64", {8, false, false}},
                           NamedType{"vtkidtype", {4, true, false}},
                           NamedType{"float", {4, true, true}},
                           NamedType{"double", {8, true, true}}};

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

}  // namespace

double load_number(const std::byte* at, const NumberType& type, bool is_big_endian) noexcept {
  if (type.is_real) return ply::load(at, type.size == 4 ? ply::Scalar::float32 : ply::Scalar::float64, is_big_endian);
  const std::uint64_t bits = ply::load_bits(at, type.size, is_big_endian);
  if (!type.is_signed) return static_cast<double>(bits);
  const auto shift = 64 - 8 * type.size;
  return static_cast<double>(static_cast<std::int64_t>(bits << shift) >> shift);
}

bool VtkTokens::line(std::string_view& line) noexcept {
  if (at_ >= bytes_.size()) return false;
  const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
  line = bytes_.substr(at_, end - at_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  at_ = std::min(end + 1, bytes_.size());
  return true;
}

void VtkTokens::skip_blank_lines() noexcept {
  while (at_ < bytes_.size() && is_space(bytes_[at_])) ++at_;
}

std::string_view VtkTokens::peek() noexcept {
  skip_blank_lines();
  const std::size_t before = at_;
  std::string_view next;
  line(next);
  at_ = before;
  return next;
}

std::vector<double> VtkTokens::text_values(std::uint64_t count) {
  if (count > (bytes_.size() - at_) / 2 + 1)
    fail("too few values follow, " + std::to_string(count) + " were announced");
  std::vector<double> values(count);
  for (double& value : values) {
    skip_blank_lines();
    const char* const end = bytes_.data() + bytes_.size();
    auto [stop, error] = std::from_chars(bytes_.data() + at_, end, value);
    if (error == std::errc::result_out_of_range) value = std::numeric_limits<double>::quiet_NaN(), error = {};
    if (error != std::errc{} || (stop != end && !is_space(*stop))) fail("expected a number");
    at_ = static_cast<std::size_t>(stop - bytes_.data());
  }
  return values;
}

std::vector<double> VtkTokens::values(std::uint64_t count, std::string_view type) {
  const std::string wanted = lower(type);
  const NumberType* found = nullptr;
  for (const NamedType& known : types)
    if (known.name == wanted) found = &known.number;
  if (found == nullptr) fail("values of type \"" + std::string(type) + "\" are not read; export them as float", true);
  if (!is_binary) return text_values(count);
  if (d3plot::times(count, found->size) > bytes_.size() - at_)
    fail("the file ends within " + std::to_string(count) + " values; it is cut short");
  std::vector<double> values(count);
  for (double& value : values) {
    value = load_number(reinterpret_cast<const std::byte*>(bytes_.data() + at_), *found, true);
    at_ += found->size;
  }
  return values;
}

std::vector<std::uint64_t> VtkTokens::indices(std::uint64_t count, std::string_view type) {
  std::vector<std::uint64_t> result;
  result.reserve(std::min<std::uint64_t>(count, bytes_.size()));
  for (const double value : values(count, type)) {
    if (!(value >= 0 && value < 4294967295.0)) fail("an index is negative or too large");
    result.push_back(static_cast<std::uint64_t>(value));
  }
  return result;
}

void VtkTokens::fail(const std::string& what, bool is_unsupported) const {
  throw Error{is_unsupported ? Status::unsupported_input : Status::bad_input,
              name_ + ", byte " + std::to_string(at_) + ": " + what + " (VTK legacy file)"};
}

}  // namespace lbea::io::grid
