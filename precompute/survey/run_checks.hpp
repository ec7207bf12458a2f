// What the survey refuses of a run that can be read, and what it reports to the user.
#pragma once

#include "precompute/survey/survey.hpp"

namespace lbea::bake {
/// A node that moves away from all others has diverged: it would make the envelope and the basis meaningless.
class NodeDistances {
 public:
  /// Positions of all nodes in the next used state; free ones do not count.
  void add(std::uint32_t step, const std::vector<float>& positions, const std::vector<std::uint8_t>& is_free);
  /// Throws Error{bad_input} when a node of an element came too far from the others.
  void refuse_far(SimulationReader& reader, const std::string& run, const std::string& unit) const;

 private:
  std::vector<float> first_;                               // positions in the first state
  std::vector<std::uint8_t> free_at_first_;                // per node
  std::vector<std::pair<double, std::uint32_t>> largest_;  // per node: distance from the middle, and its state
};

/// Why a run seems to be another component, in another place or in another unit than the reference run; empty when its
/// nodes lie near those of the same ids. Throws Error{bad_input} when, in addition, a mesh of another size has no ids.
[[nodiscard]] std::string misfit(const SimulationMesh& reference, const SimulationMesh& mesh, const std::string& run,
                                 const std::string& unit);

/// Why the times of a run look wrong: a state comes much later or earlier after the one before it than usual, as when a
/// file is missing. Nothing when they are regular; a shorter last interval is.
[[nodiscard]] std::optional<std::string> irregular_times(const RunSurvey& survey, const std::string& run);

/// A crash takes milliseconds: other times are mostly in another unit than time_unit says.
[[nodiscard]] std::optional<std::string> unlikely_times(const Survey& survey);

/// The runs with fewer states than most or an earlier end. names: of survey.runs.
[[nodiscard]] std::optional<std::string> short_runs(const Survey& survey, const std::vector<std::string>& names);

/// The runs that begin at another time than most, or take more than three times as long. names: of survey.runs.
[[nodiscard]] std::optional<std::string> odd_times(const Survey& survey, const std::vector<std::string>& names);

/// The runs that lack states which the selection asks for by its last one.
[[nodiscard]] std::optional<std::string> missing_last(const Survey& survey, const std::vector<std::string>& names,
                                                      const StepSelection& selection);
}  // namespace lbea::bake
