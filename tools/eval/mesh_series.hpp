// Meshes for ParaView: the matched sample, and the estimate with its inferred fields and their spread.
#pragma once

#include "adapters/export/vtu.hpp"
#include "tools/shared/matching/shapes.hpp"

#include <lbea/inference.hpp>

namespace lbea::tool {

/// The meshes of one test: FOLDER/matched_<number>.vtu and estimate_<number>.vtu, and their series as .pvd. All members
/// throw Error{write_failed}, and Error{bad_input} for samples that the model does not have.
class MeshSeries {
 public:
  MeshSeries(const Model& model, std::filesystem::path folder) : model_(model), folder_(std::move(folder)) {}
  /// The whole mesh of the sample with all fields. Eroded elements have EROSION_STATUS 0, in estimates, too.
  void add_match(const std::string& number, std::uint32_t sample, double time_s);
  /// The whole mesh of the estimate: weighted mean of every field, "<field>_spread" with its standard deviation over
  /// the plausible candidates, "<field>_bound_90" with its bound; "position_spread" and "position_bound_90", the same
  /// for the nodes, length unit. No bounds where they are not known.
  void add_estimate(const std::string& number, const SurfaceFit& fit, double time_s);
  /// Writes matched.pvd and, if there is any estimate, estimate.pvd.
  void finish() const;

 private:
  using Arrays = std::vector<io::VtuArray>;
  /// The array EROSION_STATUS, when some sample lacks elements. The grid keeps a view of what is returned.
  [[nodiscard]] std::vector<std::uint32_t> add_erosion(const Shape& shape, io::VtuGrid& grid) const;
  static void add_uncertainty(const std::string& name, const Inferred& inferred, Arrays& arrays);

  const Model& model_;
  std::filesystem::path folder_;
  std::vector<io::PvdEntry> matches_, estimates_;
};

}  // namespace lbea::tool
