// The layout of a model file, as specified in runtime/FORMAT.md.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <type_traits>

namespace lbea::format {

static_assert(std::endian::native == std::endian::little, "model files are little-endian and mapped as they are");

// A byte above 127, CRLF and Ctrl-Z: a transfer in text mode destroys one of them.
inline constexpr std::array<std::uint8_t, 8> magic{0x89, 'L', 'B', 'E', 'A', '\r', '\n', 0x1a};
inline constexpr std::uint32_t endian_tag = 0x01020304;
inline constexpr std::uint16_t version_major = 1;  // readers refuse another
inline constexpr std::uint16_t version_minor = 3;  // readers accept any
inline constexpr std::size_t alignment = 64;
inline constexpr std::uint32_t first_optional_id = 0x8000;  // unknown sections from here on are ignored

struct Header {
  std::array<std::uint8_t, 8> magic;
  std::uint32_t endian_tag;
  std::uint16_t version_major, version_minor;
  std::uint64_t file_size;
  std::uint64_t directory_offset;
  std::uint32_t section_count;
  std::uint32_t reserved0;
  std::uint64_t directory_checksum;
  std::uint64_t reserved1;
  std::uint64_t header_checksum;  // of the 56 bytes before it
};
static_assert(sizeof(Header) == 64 && std::is_trivially_copyable_v<Header>);

enum class ElementType : std::uint32_t { u8 = 1, u32 = 2, u64 = 3, f32 = 4, f64 = 5, u16 = 6 };
/// Bytes per element; 0 for an unknown type.
inline constexpr std::size_t size_of(ElementType type) noexcept {
  constexpr std::size_t sizes[] = {0, 1, 4, 8, 4, 8, 2};
  return static_cast<std::size_t>(type) < std::size(sizes) ? sizes[static_cast<std::size_t>(type)] : 0;
}

enum class SectionId : std::uint32_t {
  info = 1,
  provenance = 2,
  length_unit = 3,
  simulation_names = 4,
  parameter_names = 5,
  parameters = 6,
  samples = 7,
  sample_times = 8,
  node_ids = 9,
  element_ids = 10,
  element_parts = 11,
  element_nodes = 12,
  node_positions = 13,
  field_names = 14,
  field_locations = 15,
  field_values = 16,  // part: field
  envelope_grid = 17,
  envelope_bits = 18,
  simulation_branches = 19,
  leading_axes = 20,  // part: reference
  field_codes = 21,   // part: field; instead of field_values
  field_ranges = 22,  // the same
  reference_times = 32,
  vertex_nodes = 33,  // from here on, part: reference
  vertex_positions = 34,
  mass = 35,
  eigenvalues = 36,
  projection = 37,
  tree_boxes = 38,
  tree_ranges = 39,
  coefficients = 40,
  correspondence = 41,
  view_camera = 64,  // 64 to 66: all or none
  view_size = 65,
  view_depths = 66,
  view_expected = 67,           // before 1.3; not read
  landmark_positions = 0x8000,  // optional: what matching needs of node_positions
  regression_numbers = 0x8001,  // 0x8001 to 0x8005: optional, all or none, only with 64 to 66
  regression_basis = 0x8002,
  regression_images = 0x8003,
  regression_weights = 0x8004,
  regression_shapes = 0x8005,
  pose_numbers = 0x8006,            // optional, only with 64 to 66
  hidden_numbers = 0x8007,          // the same
  time_numbers = 0x8008,            // the same
  spread_bounds = 0x8009,           // the same
  expected_residuals = 0x800A,      // the same
  pose_spreads = 0x800B,            // the same
  pose_spreads_by_points = 0x8011,  // 0x8011 and 0x8012: the same, both or none
  pose_numbers_by_points = 0x8012,
  error_growths = 0x8013,    // optional, only with 64 to 66
  estimate_prices = 0x8014,  // the same
  // 0x800C to 0x8010: forecasts from the beginning of a test alone; not read
  window_numbers = 0x8018,  // 0x8018 to 0x801D: optional, all or none, only with 0x8005
  window_means = 0x8019,
  window_components = 0x801A,
  window_variances = 0x801B,
  window_runs = 0x801C,
  window_parameters = 0x801D,
  channel_names = 0x8020,  // 0x8020 to 0x8026: optional; the first three all or none
  channel_kinds = 0x8021,
  channel_values = 0x8022,
  channel_bounds = 0x8023,   // only with 64 to 66
  channel_numbers = 0x8024,  // 0x8024, 0x8025: forecasts of channels; all or none, only with 0x8018 and 0x8020
  channel_products = 0x8025,
  channel_histories = 0x8026,  // only with channels that are histories
  eroded_elements = 0x8027,    // optional: where some sample lacks elements
};

/// Cold: match() by lbea and fit does not read the section.
inline constexpr bool is_cold(SectionId id, bool has_landmarks) noexcept {
  using enum SectionId;
  constexpr SectionId cold[] = {provenance,   node_ids,    element_ids,  element_parts,  element_nodes,
                                field_values, field_codes, field_ranges, correspondence, eroded_elements};
  for (const SectionId one : cold)
    if (id == one) return true;
  return id == node_positions && has_landmarks;
}

/// In large models, matching reads landmarks: vertices that represent those around them, and nodes all over the
/// component.
inline constexpr std::uint32_t most_surface_landmarks = 1024, most_mesh_landmarks = 512;
inline constexpr std::uint32_t surface_landmarks(std::uint32_t vertices) noexcept {
  return vertices < most_surface_landmarks ? vertices : most_surface_landmarks;
}
inline constexpr std::uint32_t mesh_landmarks(std::uint32_t nodes) noexcept {
  return nodes < most_mesh_landmarks ? nodes : most_mesh_landmarks;
}
/// First of the k-th of `landmarks` equal parts of `count` elements.
inline constexpr std::uint32_t part_begin(std::uint64_t k, std::uint64_t landmarks, std::uint64_t count) noexcept {
  return static_cast<std::uint32_t>(k * count / landmarks);
}
/// The vertex that represents the k-th part of the vertices.
inline constexpr std::uint32_t landmark_vertex(std::uint64_t k, std::uint64_t landmarks,
                                               std::uint64_t vertices) noexcept {
  return static_cast<std::uint32_t>((2 * k + 1) * vertices / (2 * landmarks));
}

struct SectionEntry {
  std::uint32_t id, part;
  std::uint32_t element_type;
  std::uint32_t rank;
  std::array<std::uint64_t, 3> shape;  // unused dimensions are 1
  std::uint64_t offset, length;        // bytes; length without padding
  std::uint64_t checksum;
};
static_assert(sizeof(SectionEntry) == 64 && std::is_trivially_copyable_v<SectionEntry>);

/// Section `info`: the counts against which all other shapes are checked. All u32.
struct Info {
  std::uint32_t reference_mode;
  std::uint32_t vertices, modes, samples, simulations, references;
  std::uint32_t nodes, elements, fields, parameters;
  std::array<std::uint32_t, 3> envelope_cells;  // x, y, z
  std::uint32_t reserved;
};
static_assert(sizeof(Info) == 14 * sizeof(std::uint32_t) && std::is_trivially_copyable_v<Info>);

/// Section `view_camera`, all f64: the camera of the depth images, the limits of the misfit and, since 1.1, what the
/// bake learned about the comparison.
struct DepthCameraWords {
  std::array<double, 12> T_reference_sensor;
  double focal, center_column, center_row;
  double depth_origin, depth_step;
  double misfit_limit, test_misfit_limit;
  double cap, one_sided, error_per_spread;  // the last one may be 0
};
inline constexpr std::size_t depth_camera_words = 22, depth_camera_words_1_0 = 19;
static_assert(sizeof(DepthCameraWords) == depth_camera_words * sizeof(double) &&
              std::is_trivially_copyable_v<DepthCameraWords>);

/// Greatest magnitude of stored lengths and times: neither their squares nor the sums of these overflow a float.
inline constexpr double largest_measure = 1e12;
template <typename T>
constexpr bool is_measured(T value) noexcept {
  return value >= -largest_measure && value <= largest_measure;
}

/// Rows of `projection` and planes of `coefficients` are padded with zeros to whole 64-byte lines.
inline constexpr std::size_t padded(std::size_t floats) noexcept { return (floats + 15) / 16 * 16; }
/// Words of a sample's row of `eroded_elements`: a bit per element, those beyond the last one 0.
inline constexpr std::size_t words_of_elements(std::size_t elements) noexcept { return (elements + 31) / 32; }
inline constexpr std::uint64_t aligned(std::uint64_t bytes) noexcept {
  return (bytes + (alignment - 1)) / alignment * alignment;
}

}  // namespace lbea::format
