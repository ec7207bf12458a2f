#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/model/mapped_file.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea {
namespace {
constexpr std::array<std::string_view, status_count> status_names{"ok",
                                                                  "empty_frame",
                                                                  "too_many_points",
                                                                  "low_coverage",
                                                                  "file_not_found",
                                                                  "not_a_model",
                                                                  "unsupported_version",
                                                                  "corrupt_model",
                                                                  "bad_config",
                                                                  "bad_input",
                                                                  "unsupported_input",
                                                                  "write_failed",
                                                                  "endpoint_unavailable"};
constexpr std::array<std::string_view, 4> verdict_names{"unknown", "matched", "ambiguous", "no_simulation_fits"};
static_assert(status_names[static_cast<std::size_t>(Status::endpoint_unavailable)] == "endpoint_unavailable");
static_assert(verdict_names[static_cast<std::size_t>(Verdict::no_simulation_fits)] == "no_simulation_fits");

// Row `row` of a row-major table.
template <typename T>
std::span<const T> row_of(std::span<const T> table, std::size_t row, std::size_t columns) noexcept {
  return table.subspan(row * columns, columns);
}

template <typename T, std::size_t N>
std::span<const T> flat(std::span<const std::array<T, N>> table) noexcept {
  return {table.empty() ? nullptr : table.front().data(), table.size() * N};
}

/// The parts of the image between the cold sections.
std::vector<std::span<const std::byte>> hot_parts(const ModelView& view) {
  std::vector<std::span<const std::byte>> parts;
  std::span<const std::byte> rest = view.image;
  for (const auto cold : view.cold) {
    const auto before = static_cast<std::size_t>(cold.data() - rest.data());
    if (before > 0) parts.push_back(rest.first(before));
    rest = rest.subspan(before + cold.size());
  }
  if (!rest.empty()) parts.push_back(rest);
  return parts;
}

std::uint64_t size_of(const std::vector<std::span<const std::byte>>& parts) noexcept {
  std::uint64_t bytes = 0;
  for (const auto part : parts) bytes += part.size();
  return bytes;
}

/// Whether the machine can hold a copy. What is mapped instead may be dropped from memory and read again.
bool fits_into_memory(std::uint64_t bytes) noexcept { return bytes <= memory_of_machine() / 4 * 3; }
}  // namespace

std::string_view to_string(Status status) noexcept {
  const auto i = static_cast<std::size_t>(status);
  return i < status_names.size() ? status_names[i] : "unknown_status";
}

std::string_view to_string(Verdict verdict) noexcept {
  const auto i = static_cast<std::size_t>(verdict);
  return i < verdict_names.size() ? verdict_names[i] : "unknown";
}

Model Model::open(const std::filesystem::path& file) {
  auto mapping = std::make_shared<const MappedFile>(file);
  mapping->expect_sequential(true);
  auto view = std::make_shared<ModelView>(read_model(mapping->bytes(), name_of(file), release_pages));
  mapping->expect_sequential(false);  // normal read-ahead: cold sections are read in whole rows
  // After set-up the loop must not touch a page that is not in memory.
  for (const auto part : hot_parts(*view)) load_pages(part);
  view->owner = std::move(mapping);
  return Model(std::move(view));
}

Model Model::view(std::span<const std::byte> image) {
  return Model(std::make_shared<const ModelView>(read_model(image, "model in memory")));
}

std::uint64_t Model::bytes() const noexcept { return view_->image.size(); }
std::uint64_t Model::hot_bytes(Method method) const noexcept {
  return method == Method::vtp ? bytes() : bytes() - size_of(view_->cold);
}
bool Model::hold(Method method) const {
  if (view_->owner == nullptr) return true;
  if (!fits_into_memory(hot_bytes(method))) return false;
  const std::vector<std::span<const std::byte>> whole{view_->image};
  for (const auto part : method == Method::vtp ? whole : hot_parts(*view_)) view_->owner->hold(part);
  if (file_was_written())
    throw Error(Status::corrupt_model, "the model's file was written to while it was read; start again");
  return true;
}
bool Model::file_was_written() const noexcept { return view_->owner != nullptr && view_->owner->was_written(); }
bool Model::lock(Method method) const {
  if (method == Method::vtp) return lock_pages(view_->image, true);
  if (view_->owner != nullptr)
    for (const auto part : view_->cold) lock_pages(part, false);
  for (const auto part : hot_parts(*view_))
    if (!lock_pages(part, true)) return false;
  return true;
}

std::uint32_t Model::vertices() const noexcept { return view_->info.vertices; }
std::uint32_t Model::modes() const noexcept { return view_->info.modes; }
std::uint32_t Model::samples() const noexcept { return view_->info.samples; }
std::uint32_t Model::simulations() const noexcept { return view_->info.simulations; }
std::uint32_t Model::references() const noexcept { return view_->info.references; }
std::uint32_t Model::nodes() const noexcept { return view_->info.nodes; }
std::uint32_t Model::elements() const noexcept { return view_->info.elements; }
ReferenceMode Model::reference_mode() const noexcept { return static_cast<ReferenceMode>(view_->info.reference_mode); }
std::string_view Model::length_unit() const noexcept { return view_->length_unit; }
std::uint64_t Model::checksum() const noexcept { return view_->file_checksum; }
std::string_view Model::provenance() const noexcept { return view_->provenance; }

std::string_view Model::simulation_name(std::uint32_t simulation) const noexcept {
  return view_->simulation_names[simulation];
}
std::uint32_t Model::parameters() const noexcept { return view_->info.parameters; }
std::string_view Model::parameter_name(std::uint32_t parameter) const noexcept {
  return view_->parameter_names[parameter];
}
double Model::parameter(std::uint32_t simulation, std::uint32_t parameter) const noexcept {
  return row_of(view_->parameters, simulation, parameters())[parameter];
}
Sample Model::sample(std::uint32_t index) const noexcept { return view_->sample(index); }
double Model::sample_time_s(std::uint32_t index) const noexcept { return view_->sample_times[index]; }
std::uint32_t Model::sample_index(Sample sample) const noexcept {
  const std::array<std::uint32_t, 2> key{sample.simulation, sample.time_step};
  const auto found = std::ranges::lower_bound(view_->samples, key);
  return found != view_->samples.end() && *found == key ? static_cast<std::uint32_t>(found - view_->samples.begin())
                                                        : samples();
}

std::span<const std::uint32_t> Model::node_ids() const noexcept { return view_->node_ids; }
std::span<const std::uint32_t> Model::element_ids() const noexcept { return view_->element_ids; }
std::span<const std::uint32_t> Model::element_parts() const noexcept { return view_->element_parts; }
std::span<const std::uint32_t> Model::element_nodes() const noexcept { return flat(view_->element_nodes); }
std::span<const float> Model::node_positions(std::uint32_t sample) const noexcept {
  return row_of(view_->node_positions, sample, std::size_t{3} * nodes());
}
std::uint32_t Model::fields() const noexcept { return view_->info.fields; }
FieldInfo Model::field(std::uint32_t field) const noexcept { return view_->fields[field].info; }
std::span<const float> Model::field_values(std::uint32_t field, std::uint32_t sample) const noexcept {
  return view_->fields[field].values_of(sample);
}
std::uint32_t Model::field_size(std::uint32_t field) const noexcept {
  return static_cast<std::uint32_t>(view_->fields[field].places);
}
void Model::read_field(std::uint32_t field, std::uint32_t sample, std::span<float> into) const noexcept {
  view_->fields[field].read(sample, into);
}

std::uint32_t Model::channels() const noexcept {
  return view_->channels == nullptr ? 0 : static_cast<std::uint32_t>(view_->channels->size());
}
ChannelInfo Model::channel(std::uint32_t channel) const noexcept {
  const LearnedChannels& all = *view_->channels;
  const ChannelRow row = all.row(channel);
  return {all.names[channel], all.units[channel], static_cast<ChannelKind>(row.kind),
          static_cast<ChannelComponent>(row.component), row.cfc};
}
float Model::channel_value(std::uint32_t channel, std::uint32_t sample) const noexcept {
  return row_of(view_->channels->values, channel, samples())[sample];
}

std::span<const std::uint32_t> Model::vertex_nodes(std::uint32_t reference) const noexcept {
  return view_->references[reference].vertex_nodes;
}
std::span<const float> Model::vertex_positions(std::uint32_t reference) const noexcept {
  return flat(view_->references[reference].vertex_positions);
}
std::span<const double> Model::eigenvalues(std::uint32_t reference) const noexcept {
  return view_->references[reference].eigenvalues;
}
std::array<std::uint32_t, 3> Model::leading_axes(std::uint32_t reference) const noexcept {
  return view_->references[reference].leading_axes;
}
std::array<float, 3> Model::leading_coordinates(std::uint32_t reference, std::uint32_t sample) const noexcept {
  const ReferenceView& ref = view_->references[reference];
  const std::size_t plane = format::padded(view_->info.modes);
  std::array<float, 3> coordinates{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t mode = ref.leading_axes[k] / 3, axis = ref.leading_axes[k] % 3;
    coordinates[k] = ref.coefficients[(std::size_t{3} * sample + axis) * plane + mode];
  }
  return coordinates;
}
std::uint32_t Model::branches() const noexcept { return view_->branches; }
std::uint32_t Model::branch_of(std::uint32_t simulation) const noexcept {
  return view_->simulation_branches[simulation];
}
double Model::reference_time_s(std::uint32_t reference) const noexcept { return view_->reference_times[reference]; }
}  // namespace lbea
