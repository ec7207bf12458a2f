#include "runtime/src/model/section_reader.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cstring>

namespace lbea {
namespace {
using format::SectionEntry;
using format::SectionId;

// The titles of consecutive ids, in the order of SectionId.
constexpr std::string_view titles_from_1[] = {
    "info",    "provenance",   "length_unit", "simulation_names", "parameter_names", "parameters",
    "samples", "sample_times", "node_ids",    "element_ids",      "element_parts",   "element_nodes"};
constexpr std::string_view titles_from_13[] = {"node_positions", "field_names",   "field_locations",     "field_values",
                                               "envelope_grid",  "envelope_bits", "simulation_branches", "leading_axes",
                                               "field_codes",    "field_ranges"};
constexpr std::string_view titles_from_32[] = {"reference_times", "vertex_nodes",  "vertex_positions", "mass",
                                               "eigenvalues",     "projection",    "tree_boxes",       "tree_ranges",
                                               "coefficients",    "correspondence"};
constexpr std::string_view titles_from_64[] = {"view_camera", "view_size", "view_depths", "view_expected"};
constexpr std::string_view optional_titles[] = {
    "landmark_positions",  "regression_numbers",     "regression_basis",       "regression_images",
    "regression_weights",  "regression_shapes",      "pose_numbers",           "hidden_numbers",
    "time_numbers",        "spread_bounds",          "expected_residuals",     "pose_spreads",
    "forecast_numbers",    "forecast_means",         "forecast_components",    "forecast_runs",
    "forecast_parameters", "pose_spreads_by_points", "pose_numbers_by_points", "error_growths",
    "estimate_prices"};
constexpr std::string_view titles_from_0x8018[] = {"window_numbers",   "window_means", "window_components",
                                                   "window_variances", "window_runs",  "window_parameters"};
constexpr std::string_view titles_from_0x8020[] = {"channel_names",     "channel_kinds",   "channel_values",
                                                   "channel_bounds",    "channel_numbers", "channel_products",
                                                   "channel_histories", "eroded_elements"};
static_assert(std::size(titles_from_1) == 12 && std::size(titles_from_13) == 10 && std::size(titles_from_32) == 10);

std::string_view title_after(SectionId first, SectionId id, std::span<const std::string_view> titles) noexcept {
  const auto i = static_cast<std::uint32_t>(id) - static_cast<std::uint32_t>(first);
  return i < titles.size() ? titles[i] : std::string_view();
}

// a * b; false when that overflows.
bool multiply(std::uint64_t a, std::uint64_t b, std::uint64_t& product) noexcept {
  return !__builtin_mul_overflow(a, b, &product);
}

bool byte_count(const SectionEntry& entry, std::uint64_t& bytes) noexcept {
  bytes = format::size_of(static_cast<format::ElementType>(entry.element_type));
  return bytes != 0 &&
         std::ranges::all_of(entry.shape, [&](std::uint64_t extent) { return multiply(bytes, extent, bytes); });
}

const char* const bake_again = "; copy the file again or bake it again";
}  // namespace

std::string title(SectionId id) {
  std::string found(title_after(SectionId::info, id, titles_from_1));
  if (found.empty()) found = title_after(SectionId::node_positions, id, titles_from_13);
  if (found.empty()) found = title_after(SectionId::reference_times, id, titles_from_32);
  if (found.empty()) found = title_after(SectionId::view_camera, id, titles_from_64);
  if (found.empty()) found = title_after(SectionId::landmark_positions, id, optional_titles);
  if (found.empty()) found = title_after(SectionId::window_numbers, id, titles_from_0x8018);
  if (found.empty()) found = title_after(SectionId::channel_names, id, titles_from_0x8020);
  return found.empty() ? "unknown" : found;
}

SectionReader::SectionReader(std::span<const std::byte> image, std::string name, const Release& release)
    : image_(image), name_(std::move(name)) {
  check_header();
  check_directory(release);
}

void SectionReader::check_header() {
  format::Header header;
  if (image_.size() < format::magic.size() ||
      std::memcmp(image_.data(), format::magic.data(), format::magic.size()) != 0)
    throw Error(
        Status::not_a_model,
        name_ + ": byte 0: not an lbea model (the first eight bytes are another format's); make one with lbea-bake");
  const auto corrupt = [&](const std::string& what) -> Error {
    return {Status::corrupt_model, name_ + ": header, " + what + bake_again};
  };
  if (image_.size() < sizeof(header)) throw corrupt("byte " + std::to_string(image_.size()) + ": cut short");
  if (reinterpret_cast<std::uintptr_t>(image_.data()) % format::alignment != 0)
    throw Error(Status::bad_config, name_ + ": the image in memory does not start at a multiple of 64; align it");
  std::memcpy(&header, image_.data(), sizeof(header));
  if (checksum_of(image_.first(offsetof(format::Header, header_checksum))) != header.header_checksum)
    throw corrupt("byte 56: checksum does not match");
  if (header.version_major != format::version_major)
    throw Error(Status::unsupported_version, name_ + ": header, byte 12: model format " +
                                                 std::to_string(header.version_major) + ", this library reads " +
                                                 std::to_string(format::version_major) +
                                                 "; bake the ensemble with a matching lbea-bake");
  if (header.endian_tag != format::endian_tag) throw corrupt("byte 8: written on a machine of another byte order");
  if (header.file_size != image_.size())
    throw corrupt("byte 16: the file has " + std::to_string(image_.size()) + " bytes and should have " +
                  std::to_string(header.file_size));
  if (header.reserved0 != 0 || header.reserved1 != 0) throw corrupt("bytes 36 and 48: reserved and not zero");
  if (header.directory_offset != sizeof(header)) throw corrupt("byte 24: the directory does not follow the header");
  if (header.section_count > (image_.size() - sizeof(header)) / sizeof(SectionEntry))
    throw corrupt("byte 32: the directory is longer than the file");
  const std::size_t directory_bytes = header.section_count * sizeof(SectionEntry);
  directory_checksum_ = header.directory_checksum;
  if (checksum_of(image_.subspan(sizeof(header), directory_bytes)) != directory_checksum_)
    throw corrupt("byte 40: checksum of the directory does not match");
  const void* directory = image_.data() + sizeof(header);
  entries_ = {static_cast<const SectionEntry*>(directory), header.section_count};
}

void SectionReader::check_directory(const Release& release) {
  std::uint64_t end = sizeof(format::Header) + entries_.size_bytes();
  const SectionEntry* previous = nullptr;
  for (const SectionEntry& entry : entries_) {
    if (previous != nullptr && std::pair(previous->id, previous->part) >= std::pair(entry.id, entry.part))
      fail(static_cast<SectionId>(entry.id), entry.part, "directory not in ascending order");
    check_entry(entry, format::aligned(end));
    check_zero(end, entry.offset);
    contents_.push_back(check_content(entry, release));
    end = entry.offset + entry.length;
    previous = &entry;
  }
  if (format::aligned(end) != image_.size())
    throw Error(Status::corrupt_model,
                name_ + ": byte " + std::to_string(end) + ": bytes behind the last section" + bake_again);
  check_zero(end, image_.size());
}

void SectionReader::check_entry(const SectionEntry& entry, std::uint64_t expected_offset) const {
  const auto id = static_cast<SectionId>(entry.id);
  std::uint64_t bytes = 0;
  if (!byte_count(entry, bytes) || bytes != entry.length)
    fail(id, entry.part, "element type, shape and length disagree");
  if (entry.rank < 1 || entry.rank > entry.shape.size() ||
      std::any_of(entry.shape.begin() + entry.rank, entry.shape.end(),
                  [](std::uint64_t extent) { return extent != 1; }))
    fail(id, entry.part, "rank and shape disagree");
  if (entry.offset != expected_offset) fail(id, entry.part, "does not follow its predecessor");
  if (entry.offset > image_.size() || entry.length > image_.size() - entry.offset)
    fail(id, entry.part, "reaches beyond the end of the file");
  if (title(id) == "unknown" && entry.id < format::first_optional_id)
    throw Error(Status::unsupported_version,
                name_ + ": section " + std::to_string(entry.id) + " is not known to this library; use a newer one");
}

SectionContent SectionReader::check_content(const SectionEntry& entry, const Release& release) const {
  const auto id = static_cast<SectionId>(entry.id);
  const auto type =
      title(id) == "unknown" ? format::ElementType::u8 : static_cast<format::ElementType>(entry.element_type);
  const SectionContent content =
      content_of(image_.subspan(entry.offset, entry.length), type, is_cold(entry) ? release : Release());
  if (content.checksum != entry.checksum) fail(id, entry.part, "checksum does not match");
  return content;
}

bool SectionReader::is_cold(const SectionEntry& entry) const noexcept {
  constexpr auto landmarks = static_cast<std::uint32_t>(SectionId::landmark_positions);
  return format::is_cold(static_cast<SectionId>(entry.id),
                         std::ranges::any_of(entries_, [](const SectionEntry& e) { return e.id == landmarks; }));
}

const SectionContent& SectionReader::content(SectionId id, std::uint32_t part) const noexcept {
  return contents_[static_cast<std::size_t>(find(id, part) - entries_.data())];
}

void SectionReader::check_zero(std::uint64_t begin, std::uint64_t end) const {
  for (std::uint64_t byte = begin; byte < end; ++byte)
    if (image_[byte] != std::byte{0})
      throw Error(Status::corrupt_model,
                  name_ + ": byte " + std::to_string(byte) + ": padding is not zero" + bake_again);
}

void SectionReader::check_shape(const SectionEntry& entry, format::ElementType type, const Shape& shape) const {
  const auto id = static_cast<SectionId>(entry.id);
  if (entry.element_type != static_cast<std::uint32_t>(type)) fail(id, entry.part, "unexpected element type");
  if (entry.shape != shape) fail(id, entry.part, "shape disagrees with section 1 'info'");
}

std::string_view SectionReader::text(SectionId id) const {
  const SectionEntry* entry = find(id);
  if (entry == nullptr) fail_missing(id, 0);
  const std::span<const char> characters = typed<char>(*entry, {entry->shape[0], 1, 1});
  return {characters.data(), characters.size()};
}

const SectionEntry* SectionReader::find(SectionId id, std::uint32_t part) const noexcept {
  const std::pair key(static_cast<std::uint32_t>(id), part);
  const auto found =
      std::ranges::lower_bound(entries_, key, {}, [](const SectionEntry& e) { return std::pair(e.id, e.part); });
  return found != entries_.end() && std::pair(found->id, found->part) == key ? &*found : nullptr;
}

void SectionReader::fail(SectionId id, std::uint32_t part, const std::string& what) const {
  const SectionEntry* entry = find(id, part);
  const std::string at = entry == nullptr ? "" : " at byte " + std::to_string(entry->offset);
  throw Error(Status::corrupt_model, name_ + ": section " + std::to_string(static_cast<std::uint32_t>(id)) + " '" +
                                         title(id) + "' part " + std::to_string(part) + at + ": " + what + bake_again);
}

void SectionReader::fail_missing(SectionId id, std::uint32_t part) const { fail(id, part, "missing"); }
}  // namespace lbea
