#include "adapters/simulation/vtk/legacy_tokens.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

#include "adapters/files/binary_numbers.hpp"
#include "adapters/files/text_line.hpp"

namespace lbea::io::grid {
namespace {

using binary::Scalar;

constexpr std::array<std::pair<std::string_view, Scalar>, 14> types{{
    {"unsigned_char", Scalar::uint8},
    {"char", Scalar::int8},
    {"signed_char", Scalar::int8},
    {"unsigned_short", Scalar::uint16},
    {"short", Scalar::int16},
    {"unsigned_int", Scalar::uint32},
    {"int", Scalar::int32},
    {"unsigned_long", Scalar::uint64},
    {"long", Scalar::int64},
    {"vtktypeint64", Scalar::int64},
    {"vtktypeuint64", Scalar::uint64},
    {"vtkidtype", Scalar::int32},
    {"float", Scalar::float32},
    {"double", Scalar::float64},
}};

}  // namespace

bool VtkTokens::line(std::string_view& line) noexcept {
  if (at_ >= bytes_.size()) return false;
  const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
  line = bytes_.substr(at_, end - at_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  at_ = std::min(end + 1, bytes_.size());
  return true;
}

void VtkTokens::skip_blank_lines() noexcept {
  while (at_ < bytes_.size() && text::is_space(bytes_[at_])) ++at_;
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
  if (count > (bytes_.size() - at_) / 2 + 1) fail("too few values follow, " + std::to_string(count) + " were declared");
  std::vector<double> values(count);
  for (double& value : values) {
    skip_blank_lines();
    std::string_view rest = bytes_.substr(at_);
    if (!text::next_real(rest, value) || (!rest.empty() && !text::is_space(rest.front()))) fail("expected a number");
    at_ = bytes_.size() - rest.size();
  }
  return values;
}

std::vector<double> VtkTokens::values(std::uint64_t count, std::string_view type) {
  const std::string wanted = text::lower(type);
  const auto found = std::find_if(types.begin(), types.end(), [&](const auto& known) { return known.first == wanted; });
  if (found == types.end())
    fail("values of type \"" + std::string(type) + "\" are not read; export them as float", true);
  if (!is_binary) return text_values(count);
  const std::size_t size = binary::size_of(found->second);
  if (binary::times(count, size) > bytes_.size() - at_)
    fail("the file ends within " + std::to_string(count) + " values; it is cut short");
  std::vector<double> values(count);
  for (double& value : values) {
    value = binary::load(reinterpret_cast<const std::byte*>(bytes_.data() + at_), found->second, true);
    at_ += size;
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
