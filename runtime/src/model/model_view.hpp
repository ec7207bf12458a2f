// The sections of a model file as spans, checked when the file is opened.
#pragma once

#include "runtime/src/model/field_codes.hpp"
#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <functional>

namespace lbea {
/// The baked KD-tree over the vertices of a reference mesh. Layout in FORMAT.md, sections 34, 38 and 39. Checked when
/// the model is opened.
struct VertexTree {
  std::span<const std::array<float, 3>> vertices;
  std::span<const std::array<float, 6>> boxes;
  std::span<const std::array<std::uint32_t, 3>> ranges;
};

// The checks at open. Only a tree that passes both may be searched.
[[nodiscard]] bool ranges_form_one_tree(const VertexTree& tree) noexcept;
[[nodiscard]] bool boxes_hold_their_vertices(const VertexTree& tree) noexcept;  // after the other check

inline constexpr std::uint32_t vertex_tree_leaf = 16;
inline constexpr std::uint32_t vertex_tree_max_depth = 64;

class MappedFile;
struct LearnedForecast;
struct LearnedChannels;

/// The sections of one reference mesh. Shapes as in FORMAT.md, sections 33 to 41.
struct ReferenceView {
  std::span<const std::uint32_t> vertex_nodes;
  std::span<const std::array<float, 3>> vertex_positions;
  std::span<const double> mass;
  std::span<const double> eigenvalues;
  std::span<const float> projection;  // p x padded(n)
  VertexTree tree;
  std::span<const float> coefficients;            // s x 3 x padded(p)
  std::span<const std::uint32_t> correspondence;  // s x n, empty when baked without VtP
  std::array<std::uint32_t, 3> leading_axes{};    // indices into a mode-major p x 3 array
};

/// A field, stored as values or as codes with a range per sample.
struct FieldView {
  FieldInfo info;
  std::size_t places = 0;                        // elements or nodes
  std::span<const float> values;                 // s x places
  std::span<const FieldCode> codes;              // s x places
  std::span<const std::array<float, 3>> ranges;  // s: low, high, largest error

  [[nodiscard]] FieldRange range(std::size_t sample) const noexcept { return {ranges[sample][0], ranges[sample][1]}; }
  /// Empty when the field is stored as codes.
  [[nodiscard]] std::span<const float> values_of(std::size_t sample) const noexcept {
    return values.empty() ? values : values.subspan(sample * places, places);
  }
  /// into: `places` values.
  void read(std::size_t sample, std::span<float> into) const noexcept;
};

struct EnvelopeView {
  std::array<float, 3> corner{};
  float cell = 0;
  std::array<std::uint32_t, 3> cells{};
  std::span<const std::uint64_t> bits;
};

struct ModelView {
  format::Info info{};
  std::string_view provenance, length_unit;
  std::vector<std::string_view> simulation_names, parameter_names;
  std::span<const double> parameters;  // simulations x parameters
  std::span<const std::uint32_t> simulation_branches;
  std::uint32_t branches = 0;
  std::span<const std::array<std::uint32_t, 2>> samples;
  std::span<const double> sample_times;
  std::span<const std::uint32_t> node_ids, element_ids, element_parts;
  std::span<const std::array<std::uint32_t, 4>> element_nodes;
  std::span<const float> node_positions;      // s x N x 3
  std::span<const float> landmark_positions;  // s x (surface_landmarks + mesh_landmarks) x 3, or empty
  std::size_t landmark_edges = 0;             // SurfacePlaces::edges of the surface's landmarks, only while baking
  std::vector<FieldView> fields;
  std::span<const std::uint32_t>
      eroded;  // s x words_of_elements(E), see eroded_elements.hpp; empty: no sample lacks elements
  EnvelopeView envelope;
  std::span<const double> reference_times;
  std::vector<ReferenceView> references;
  std::shared_ptr<const DepthImages> depth_images;                    // null when baked without a sensor
  std::vector<std::shared_ptr<const DepthImages>> more_depth_images;  // of further rigs
  std::shared_ptr<const LearnedForecast> forecast;                    // null when the bake has learned none
  std::shared_ptr<const LearnedChannels> channels;                    // null when the description names none
  std::uint64_t file_checksum = 0;  // of the directory, which covers every section: identifies this model
  std::span<const std::byte> image;
  std::vector<std::span<const std::byte>>
      cold;                                 // parts of the image that match() by lbea and fit does not read, ascending
  std::shared_ptr<const MappedFile> owner;  // null for a model in the caller's memory

  [[nodiscard]] Sample sample(std::uint32_t row) const noexcept { return {samples[row][0], samples[row][1]}; }
  /// The sample's landmarks: first those on the observed surface, then those on the whole component.
  [[nodiscard]] std::span<const float> landmarks(std::uint32_t sample) const noexcept {
    const std::size_t floats = landmark_positions.size() / info.samples;
    return landmark_positions.subspan(sample * floats, floats);
  }
};

/// Checks `image` by the rules of FORMAT.md. `name` is the model's name in errors. release: see SectionReader.
/// Throws Error{not_a_model | unsupported_version | corrupt_model}.
[[nodiscard]] ModelView read_model(std::span<const std::byte> image, const std::string& name,
                                   const std::function<void(std::span<const std::byte>)>& release = {});
}  // namespace lbea
