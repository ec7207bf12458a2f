// Meshes for ParaView: the matched sample, and the estimate with its inferred fields and their spread.
#pragma once

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// Writes the whole mesh of the sample with all fields. Throws Error{write_failed}.
void write_matched_mesh(const std::filesystem::path& file, const Model& model, std::uint32_t sample);

/// Writes the whole mesh of the estimate: weighted mean of every field, "<field>_spread" with its standard deviation
/// over the plausible candidates, and "position_spread", the same for the nodes, length unit. candidates: with their
/// residuals. Throws Error{write_failed}, Error{bad_input} for samples that the model does not have.
void write_estimate_mesh(const std::filesystem::path& file, const Model& model,
                         std::span<const WeightedSample> estimate, std::span<const Match> candidates, double time_s);

/// The weighted mean of the sample times.
[[nodiscard]] double estimate_time_s(const Model& model, std::span<const WeightedSample> estimate);

}  // namespace lbea::tool
