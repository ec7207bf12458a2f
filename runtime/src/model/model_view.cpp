#include "runtime/src/model/model_view.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/forecast/learned_forecast.hpp"
#include "runtime/src/model/section_reader.hpp"

#include <cstring>

namespace lbea {
namespace {

using format::SectionId;

// Checks the content of the sections. An error names the section.
class ModelReader {
 public:
  ModelReader(std::span<const std::byte> image, const std::string& name, const SectionReader::Release& release)
      : sections_(image, name, release) {
    view_.image = image;
    for (const format::SectionEntry& entry : sections_.entries())
      if (sections_.is_cold(entry)) view_.cold.push_back(image.subspan(entry.offset, entry.length));
  }

  ModelView read() {
    read_info();
    read_ensemble();
    read_component();
    read_fields();
    read_envelope();
    for (std::uint32_t r = 0; r < view_.info.references; ++r) read_reference(r);
    read_views();
    view_.channels = read_channels(sections_, view_.info);
    view_.forecast = read_forecast(sections_, view_.info, view_.channels == nullptr ? 0 : view_.channels->size());
    view_.file_checksum = sections_.directory_checksum();
    return std::move(view_);
  }

 private:
  void require(bool holds, SectionId id, std::uint32_t part, const char* what) const {
    if (!holds) sections_.fail(id, part, what);
  }
  void require_below(std::uint32_t limit, SectionId id, std::uint32_t part) const {
    require(sections_.content(id, part).greatest < limit, id, part, "an index is out of range");
  }
  void require_measured(SectionId id, std::uint32_t part = 0) const {
    require(sections_.content(id, part).is_measured, id, part, "a value is not finite or too large");
  }

  void read_views() {
    const auto read = [this](std::uint32_t rig) {
      return read_depth_images(sections_, view_.info, view_.length_unit, rig);
    };
    view_.depth_images = read(0);
    if (view_.depth_images == nullptr) return;
    for (std::uint32_t rig = 1; auto images = read(rig); ++rig) view_.more_depth_images.push_back(std::move(images));
  }

  void read_info() {
    const auto words = sections_.required<std::uint32_t>(SectionId::info, {sizeof(format::Info) / 4, 1, 1});
    std::memcpy(&view_.info, words.data(), sizeof(format::Info));
    const format::Info& info = view_.info;
    require(info.reference_mode <= static_cast<std::uint32_t>(ReferenceMode::over_time), SectionId::info, 0,
            "unknown reference mode");
    require(info.vertices > 0 && info.modes > 0 && info.samples > 0 && info.simulations > 0 && info.references > 0 &&
                info.nodes > 0 && info.elements > 0,
            SectionId::info, 0, "a count is zero");
    require(info.modes <= info.vertices && info.vertices <= info.nodes, SectionId::info, 0,
            "more modes than vertices or more vertices than nodes");
  }

  std::vector<std::string_view> read_strings(SectionId id, std::uint64_t expected) const {
    std::string_view rest = sections_.text(id);
    require(rest.empty() || rest.back() == '\0', id, 0, "the last string is not ended");
    std::vector<std::string_view> strings;
    while (!rest.empty()) {
      strings.push_back(rest.substr(0, rest.find('\0')));
      rest.remove_prefix(strings.back().size() + 1);
    }
    require(strings.size() == expected, id, 0, "another number of strings than section 1 'info' says");
    return strings;
  }

  void read_ensemble() {
    const format::Info& info = view_.info;
    view_.provenance = sections_.text(SectionId::provenance);
    view_.length_unit = read_strings(SectionId::length_unit, 1).front();
    view_.simulation_names = read_strings(SectionId::simulation_names, info.simulations);
    view_.parameter_names = read_strings(SectionId::parameter_names, info.parameters);
    view_.parameters = sections_.required<double>(SectionId::parameters, {info.simulations, info.parameters, 1});
    view_.samples = sections_.required<std::array<std::uint32_t, 2>>(SectionId::samples, {info.samples, 2, 1});
    view_.sample_times = sections_.required<double>(SectionId::sample_times, {info.samples, 1, 1});
    require(std::ranges::adjacent_find(view_.samples, std::ranges::greater_equal{}) == view_.samples.end(),
            SectionId::samples, 0, "not strictly ascending");
    require(view_.samples.back()[0] < info.simulations, SectionId::samples, 0, "an index is out of range");
    require_measured(SectionId::sample_times);
    view_.simulation_branches =
        sections_.required<std::uint32_t>(SectionId::simulation_branches, {info.simulations, 1, 1});
    require_below(info.simulations, SectionId::simulation_branches, 0);
    view_.branches = *std::ranges::max_element(view_.simulation_branches) + 1;
  }

  void read_component() {
    const format::Info& info = view_.info;
    view_.node_ids = sections_.required<std::uint32_t>(SectionId::node_ids, {info.nodes, 1, 1});
    view_.element_ids = sections_.required<std::uint32_t>(SectionId::element_ids, {info.elements, 1, 1});
    view_.element_parts = sections_.required<std::uint32_t>(SectionId::element_parts, {info.elements, 1, 1});
    view_.element_nodes =
        sections_.required<std::array<std::uint32_t, 4>>(SectionId::element_nodes, {info.elements, 4, 1});
    view_.node_positions = sections_.required<float>(SectionId::node_positions, {info.samples, info.nodes, 3});
    require_below(info.nodes, SectionId::element_nodes, 0);
    require_measured(SectionId::node_positions);
    const std::uint64_t landmarks =
        std::uint64_t{format::surface_landmarks(info.vertices)} + format::mesh_landmarks(info.nodes);
    view_.landmark_positions = sections_.optional<float>(SectionId::landmark_positions, {info.samples, landmarks, 3});
    if (!view_.landmark_positions.empty()) require_measured(SectionId::landmark_positions);
    read_eroded();
  }

  void read_eroded() {
    const std::size_t words = format::words_of_elements(view_.info.elements), rest = view_.info.elements % 32;
    view_.eroded = sections_.optional<std::uint32_t>(SectionId::eroded_elements, {view_.info.samples, words, 1});
    for (std::size_t last = words; rest > 0 && last <= view_.eroded.size(); last += words)
      require(view_.eroded[last - 1] >> rest == 0, SectionId::eroded_elements, 0,
              "a bit beyond the last element is set");
  }

  void read_fields() {
    const format::Info& info = view_.info;
    const auto names = read_strings(SectionId::field_names, 2 * std::uint64_t{info.fields});
    const auto locations = sections_.required<std::uint32_t>(SectionId::field_locations, {info.fields, 1, 1});
    for (std::uint32_t f = 0; f < info.fields; ++f) {
      require(locations[f] <= static_cast<std::uint32_t>(FieldInfo::Location::node), SectionId::field_locations, 0,
              "unknown location");
      const auto location = static_cast<FieldInfo::Location>(locations[f]);
      FieldView field;
      field.info = {names[2 * f], names[2 * f + 1], location};
      field.places = location == FieldInfo::Location::element ? info.elements : info.nodes;
      read_values(f, field);
      view_.fields.push_back(std::move(field));
    }
  }

  void read_values(std::uint32_t f, FieldView& field) {
    const std::uint64_t samples = view_.info.samples;
    if (sections_.find(SectionId::field_codes, f) == nullptr) {
      field.values = sections_.required<float>(SectionId::field_values, {samples, field.places, 1}, f);
      return;
    }
    require(sections_.find(SectionId::field_values, f) == nullptr, SectionId::field_codes, f,
            "the field is stored twice");
    field.codes = sections_.required<FieldCode>(SectionId::field_codes, {samples, field.places, 1}, f);
    field.ranges = sections_.required<std::array<float, 3>>(SectionId::field_ranges, {samples, 3, 1}, f);
    for (const auto& [low, high, error] : field.ranges) {
      require(std::isfinite(low) && std::isfinite(high) && low <= high, SectionId::field_ranges, f,
              "the least value is not below the greatest");
      require(error == largest_error({low, high}), SectionId::field_ranges, f,
              "the error is not that of 16 bits between the least and the greatest value");
      field.info.largest_error = std::max(field.info.largest_error, error);
    }
  }

  void read_envelope() {
    const auto grid = sections_.required<float>(SectionId::envelope_grid, {4, 1, 1});
    require_measured(SectionId::envelope_grid);
    require(grid[3] > 0, SectionId::envelope_grid, 0, "the cells have no size");
    const auto& cells = view_.info.envelope_cells;
    constexpr std::uint32_t most_cells_along_an_axis = 1u << 16;
    require(std::ranges::all_of(cells, [](std::uint32_t c) { return c > 0 && c <= most_cells_along_an_axis; }),
            SectionId::info, 0, "an impossible number of envelope cells");
    const std::uint64_t count = std::uint64_t{cells[0]} * cells[1] * cells[2];
    require(count < std::uint64_t{1} << 31, SectionId::info, 0,
            "an impossible number of envelope cells");  // numbered in 32 bits
    view_.envelope = {{grid[0], grid[1], grid[2]},
                      grid[3],
                      cells,
                      sections_.required<std::uint64_t>(SectionId::envelope_bits, {(count + 63) / 64, 1, 1})};
  }

  void read_reference(std::uint32_t r) {
    const format::Info& info = view_.info;
    if (r == 0) {
      view_.reference_times = sections_.required<double>(SectionId::reference_times, {info.references, 1, 1});
      require_measured(SectionId::reference_times);
      require(std::ranges::is_sorted(view_.reference_times), SectionId::reference_times, 0, "not ascending");
    }
    const std::uint64_t n = info.vertices, p = info.modes, s = info.samples;
    ReferenceView ref;
    ref.vertex_nodes = sections_.required<std::uint32_t>(SectionId::vertex_nodes, {n, 1, 1}, r);
    ref.vertex_positions = sections_.required<std::array<float, 3>>(SectionId::vertex_positions, {n, 3, 1}, r);
    ref.mass = sections_.required<double>(SectionId::mass, {n, 1, 1}, r);
    ref.eigenvalues = sections_.required<double>(SectionId::eigenvalues, {p, 1, 1}, r);
    ref.projection = sections_.required<float>(SectionId::projection, {p, format::padded(n), 1}, r);
    ref.coefficients = sections_.required<float>(SectionId::coefficients, {s, 3, format::padded(p)}, r);
    ref.correspondence = sections_.optional<std::uint32_t>(SectionId::correspondence, {s, n, 1}, r);
    const auto axes = sections_.required<std::uint32_t>(SectionId::leading_axes, {3, 1, 1}, r);
    require_below(3 * info.modes, SectionId::leading_axes, r);
    std::ranges::copy(axes, ref.leading_axes.begin());
    require_below(info.nodes, SectionId::vertex_nodes, r);
    if (!ref.correspondence.empty()) require_below(info.nodes, SectionId::correspondence, r);
    require_measured(SectionId::vertex_positions, r);
    require_measured(SectionId::mass, r);
    require(std::ranges::all_of(ref.mass, [](double mass) { return mass > 0; }), SectionId::mass, r,
            "a mass is not positive");
    require_measured(SectionId::eigenvalues, r);
    require_measured(SectionId::projection, r);
    require_measured(SectionId::coefficients, r);
    read_tree(r, ref);
    view_.references.push_back(std::move(ref));
  }

  void read_tree(std::uint32_t r, ReferenceView& ref) {
    const format::SectionEntry* entry = sections_.find(SectionId::tree_ranges, r);
    const std::uint64_t tree_nodes = entry == nullptr ? 0 : entry->shape[0];
    ref.tree.vertices = ref.vertex_positions;
    ref.tree.ranges = sections_.required<std::array<std::uint32_t, 3>>(SectionId::tree_ranges, {tree_nodes, 3, 1}, r);
    ref.tree.boxes = sections_.required<std::array<float, 6>>(SectionId::tree_boxes, {tree_nodes, 6, 1}, r);
    require(ranges_form_one_tree(ref.tree), SectionId::tree_ranges, r, "the ranges do not form one tree");
    require(boxes_hold_their_vertices(ref.tree), SectionId::tree_boxes, r, "a box does not hold its vertices");
  }

  SectionReader sections_;
  ModelView view_;
};

}  // namespace

void FieldView::read(std::size_t sample, std::span<float> into) const noexcept {
  if (codes.empty())
    std::ranges::copy(values_of(sample), into.begin());
  else
    decode(codes.subspan(sample * places, places), range(sample), into);
}

ModelView read_model(std::span<const std::byte> image, const std::string& name, const SectionReader::Release& release) {
  return ModelReader(image, name, release).read();
}

bool ranges_form_one_tree(const VertexTree& tree) noexcept {
  struct Subtree {
    std::uint32_t node, first, count, level;
  };
  std::array<Subtree, vertex_tree_max_depth> right_siblings;  // not yet visited, innermost last
  std::size_t depth = 0;
  Subtree expected{0, 0, static_cast<std::uint32_t>(tree.vertices.size()), 0};
  for (std::uint32_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    if (node != expected.node || first != expected.first || count != expected.count || count == 0) return false;
    if (right == 0) {
      if (depth == 0) return node + 1 == tree.ranges.size();
      expected = right_siblings[--depth];
      continue;
    }
    const std::uint32_t below = expected.level + 1;
    if (below > vertex_tree_max_depth || right <= node + 1 || right >= tree.ranges.size()) return false;
    const std::uint32_t left_count = tree.ranges[node + 1][1];
    if (left_count >= count) return false;
    right_siblings[depth++] = {right, first + left_count, count - left_count, below};
    expected = {node + 1, first, left_count, below};
  }
  return false;
}

bool boxes_hold_their_vertices(const VertexTree& tree) noexcept {
  for (std::size_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    const auto& box = tree.boxes[node];
    const auto held = [&](const std::array<float, 3>& v) {
      return box[0] <= v[0] && v[0] <= box[3] && box[1] <= v[1] && v[1] <= box[4] && box[2] <= v[2] && v[2] <= box[5];
    };
    if (!std::ranges::all_of(tree.vertices.subspan(first, count), held)) return false;
  }
  return true;
}

}  // namespace lbea
