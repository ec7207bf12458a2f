// Meshes for ParaView: the matched sample, and the estimate with its inferred fields and their spread.
#pragma once

#include "adapters/export/vtu.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// The meshes of one test: FOLDER/matched_<number>.vtu and estimate_<number>.vtu, and their series as .pvd. All members
/// throw Error{write_failed}, and Error{bad_input} for samples that the model does not have.
class MeshSeries {
 public:
  MeshSeries(const Model& model, std::filesystem::path folder) : model_(model), folder_(std::move(folder)) {}
  /// The whole mesh of the sample with all fields.
  void add_match(const std::string& number, std::uint32_t sample, double time_s);
  /// The whole mesh of the estimate: weighted mean of every field, "<field>_spread" with its standard deviation over
  /// the plausible candidates, and "position_spread", the same for the nodes, length unit. candidates: with their
  /// residuals.
  void add_estimate(const std::string& number, std::span<const WeightedSample> estimate,
                    std::span<const Match> candidates, double time_s);
  /// Writes matched.pvd and, if there is any estimate, estimate.pvd.
  void finish() const;

 private:
  const Model& model_;
  std::filesystem::path folder_;
  std::vector<io::PvdEntry> matches_, estimates_;
};

/// The weighted mean of the sample times.
[[nodiscard]] double estimate_time_s(const Model& model, std::span<const WeightedSample> estimate);

}  // namespace lbea::tool
