// Meshes for ParaView: the matched sample, and the shape between the samples with what it makes known and how surely.
#pragma once

#include <lbea/lbea.hpp>

#include <filesystem>
#include <span>

namespace lbea::tool {

/// The sample's whole mesh with all its fields. Throws Error{write_failed}.
void write_matched_mesh(const std::filesystem::path& file, const Model& model, std::uint32_t sample);

/// The estimate's whole mesh: every field as the shares' mean, and beside it "<field>_spread", the standard deviation
/// over the plausible candidates; "position_spread", the same of the nodes, length unit. candidates: with their
/// residuals. Throws Error{write_failed}, Error{bad_input} for samples that the model does not hold.
void write_estimate_mesh(const std::filesystem::path& file, const Model& model,
                         std::span<const WeightedSample> estimate, std::span<const Match> candidates, double time_s);

/// The shares' mean of the samples' times.
[[nodiscard]] double estimate_time_s(const Model& model, std::span<const WeightedSample> estimate);

}  // namespace lbea::tool
