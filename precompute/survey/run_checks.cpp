#include "precompute/survey/run_checks.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_map>

namespace lbea::bake {
namespace {
using Place = std::array<double, 3>;

/// Of the component's diagonal. Debris at 100 m/s covers about 200 diagonals of a small component during a test.
constexpr double far_diagonals = 1000;
/// Of the component's diagonal. Variants of a component and its rigid start position differ by less; wrong numbers,
/// units and coordinate systems by more.
constexpr double misfit_diagonals = 0.1;
constexpr std::size_t most_named = 3;

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string in_seconds(double time_s) { return number(time_s) + " s"; }

Place place_of(std::span<const float> positions, std::size_t node) {
  return {double{positions[3 * node]}, double{positions[3 * node + 1]}, double{positions[3 * node + 2]}};
}

double distance(const Place& a, const Place& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

template <class T>
T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Medians, which a few far nodes do not move.
Place middle_of(const std::vector<float>& positions, const std::vector<std::uint8_t>& is_free) {
  Place middle{};
  std::vector<float> values;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t node = 0; node < is_free.size(); ++node)
      if (is_free[node] == 0) values.push_back(positions[3 * node + axis]);
    if (!values.empty()) middle[axis] = double{median(values)};
  }
  return middle;
}

/// The box around some places.
struct Bounds {
  Place low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
            std::numeric_limits<double>::infinity()};
  Place high{-low[0], -low[0], -low[0]};

  void add(const Place& p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  [[nodiscard]] double diagonal() const { return low[0] <= high[0] ? distance(low, high) : 0; }
};

std::vector<std::uint8_t> nodes_of_elements(const SimulationMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.nodes());
  for (const Quad& element : mesh.elements)
    for (const std::uint32_t node : element) used[node] = 1;
  return used;
}

/// The nodes with the same ids in two meshes.
struct Comparison {
  std::vector<double> distances;
  Bounds reference, run;
};

Comparison compared(const SimulationMesh& reference, const SimulationMesh& mesh) {
  std::unordered_map<std::uint32_t, std::size_t> place;  // node id -> index in the reference
  for (std::size_t i = 0; i < reference.nodes(); ++i) place.emplace(reference.node_ids[i], i);
  Comparison comparison;
  for (std::size_t i = 0; i < mesh.nodes(); ++i) {
    const auto found = place.find(mesh.node_ids[i]);
    if (found == place.end()) continue;
    const Place here = place_of(mesh.positions, i), there = place_of(reference.positions, found->second);
    comparison.distances.push_back(distance(here, there));
    comparison.run.add(here);
    comparison.reference.add(there);
  }
  return comparison;
}

/// What a ratio of sizes suggests.
std::string suspicion(double ratio) {
  struct Units {
    double ratio;
    const char *small, *large;
  };
  constexpr std::array pairs{Units{10, "mm", "cm"}, Units{25.4, "mm", "inches"}, Units{39.37, "inches", "m"},
                             Units{100, "cm", "m"}, Units{304.8, "mm", "feet"},  Units{1000, "mm", "m"}};
  constexpr double slack = 0.1;
  for (const Units& units : pairs) {
    if (std::abs(ratio / units.ratio - 1) < slack)
      return "is the run in " + std::string(units.small) + " and the reference run in " + units.large + "?";
    if (std::abs(ratio * units.ratio - 1) < slack)
      return "is the run in " + std::string(units.large) + " and the reference run in " + units.small + "?";
  }
  return "is it in another coordinate system or numbered in another way?";
}

std::string listed(const std::vector<std::string>& texts) {
  std::string list;
  for (std::size_t i = 0; i < std::min(texts.size(), most_named); ++i) list += (i > 0 ? ", " : "") + texts[i];
  return list + (texts.size() > most_named ? " and " + std::to_string(texts.size() - most_named) + " more" : "");
}

std::string length_of(const RunSurvey& run) {
  return std::to_string(run.steps.size()) + (run.steps.size() == 1 ? " state" : " states") + " up to " +
         in_seconds(run.times_s.back());
}
}  // namespace

void NodeDistances::add(std::uint32_t step, const std::vector<float>& positions,
                        const std::vector<std::uint8_t>& is_free) {
  if (first_.empty()) first_ = positions, free_at_first_ = is_free;
  largest_.resize(is_free.size());
  const Place middle = middle_of(positions, is_free);
  for (std::size_t node = 0; node < largest_.size(); ++node)
    if (is_free[node] == 0)
      largest_[node] = std::max(largest_[node], {distance(place_of(positions, node), middle), step});
}

void NodeDistances::refuse_far(SimulationReader& reader, const std::string& run, const std::string& unit) const {
  const SimulationMesh& mesh = reader.mesh();
  const std::vector<std::uint8_t> used = nodes_of_elements(mesh);
  Bounds bounds;
  for (std::size_t node = 0; node < used.size(); ++node)
    if (used[node] != 0 && free_at_first_[node] == 0) bounds.add(place_of(first_, node));
  const double diagonal = bounds.diagonal();
  for (std::size_t node = 0; node < used.size(); ++node) {
    const auto [distance, step] = largest_[node];
    if (used[node] == 0 || diagonal == 0 || distance <= far_diagonals * diagonal) continue;
    SimulationState state;
    reader.read(step, state);
    const Place p = place_of(state.positions, node);
    throw Error(Status::bad_input, "run " + run + ", state " + std::to_string(step) + ": node " +
                                       std::to_string(mesh.node_ids[node]) + " is at (" + number(p[0]) + ", " +
                                       number(p[1]) + ", " + number(p[2]) + "), " + number(distance) + " " + unit +
                                       " from the middle of the component, which measures " + number(diagonal) + " " +
                                       unit + "; the run has diverged, leave out this state and later ones");
  }
}

std::string misfit(const SimulationMesh& reference, const SimulationMesh& mesh, const std::string& run,
                   const std::string& unit) {
  Comparison comparison = compared(reference, mesh);
  const double diagonal = comparison.reference.diagonal();
  if (comparison.distances.empty() || diagonal == 0) return {};
  const double typical = median(comparison.distances);
  if (!(typical > misfit_diagonals * diagonal)) return {};
  if (mesh.nodes() != reference.nodes() && !(mesh.has_solver_ids && reference.has_solver_ids))
    throw Error(Status::bad_input, "run " + run + ": its mesh of " + std::to_string(mesh.nodes()) +
                                       " nodes is not that of the reference run (" + std::to_string(reference.nodes()) +
                                       " nodes), and without node ids in the files nothing tells which nodes "
                                       "correspond; export ids (NODE_ID, ELEMENT_ID), or leave the run out");
  return "half of its nodes lie more than " + number(typical) + " " + unit +
         " from those of the reference run with the same ids, whose mesh measures " + number(diagonal) + " " + unit +
         "; " + suspicion(comparison.run.diagonal() / diagonal);
}

std::optional<std::string> irregular_times(const RunSurvey& survey, const std::string& run) {
  constexpr double slack = 0.1;  // share of the usual interval; solvers write a state after a whole time step
  const std::vector<std::uint32_t>& steps = survey.steps;
  std::vector<double> intervals;  // per stored state
  for (std::size_t i = 1; i < steps.size(); ++i)
    intervals.push_back((survey.times_s[i] - survey.times_s[i - 1]) / (steps[i] - steps[i - 1]));
  if (intervals.size() < 3) return std::nullopt;
  std::vector<double> sorted = intervals;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const bool is_end = i + 1 == intervals.size() && intervals[i] < usual;
    if (is_end || std::abs(intervals[i] - usual) <= slack * usual) continue;
    return "run " + run + ": state " + std::to_string(steps[i + 1]) + " comes " + in_seconds(intervals[i]) +
           " after the one before it, most others " + in_seconds(usual) + "; is a state missing?";
  }
  return std::nullopt;
}

std::optional<std::string> unlikely_times(const Survey& survey) {
  constexpr double shortest_s = 1e-4, longest_s = 5;
  double longest = 0;
  for (const RunSurvey& run : survey.runs)
    if (!run.times_s.empty()) longest = std::max(longest, run.times_s.back() - run.times_s.front());
  if (longest <= 0 || (longest >= shortest_s && longest <= longest_s)) return std::nullopt;
  return "the longest run takes " + in_seconds(longest) + "; is time_unit right?";
}

std::optional<std::string> short_runs(const Survey& survey, const std::vector<std::string>& names) {
  constexpr double share = 0.9;
  std::vector<std::size_t> counts;
  std::vector<double> ends, durations;
  for (const RunSurvey& run : survey.runs) {
    if (run.steps.empty()) continue;
    counts.push_back(run.steps.size());
    ends.push_back(run.times_s.back());
    durations.push_back(run.times_s.back() - run.times_s.front());
  }
  if (counts.empty()) return std::nullopt;
  const std::size_t usual_count = median(counts);
  const double usual_end = median(ends), slack = (1 - share) * median(durations);
  const bool has_durations = slack > 0;
  std::vector<std::string> found;
  for (std::size_t i = 0; i < survey.runs.size(); ++i) {
    const RunSurvey& run = survey.runs[i];
    if (run.steps.empty()) continue;
    const bool is_short = static_cast<double>(run.steps.size()) < share * static_cast<double>(usual_count) ||
                          (has_durations && run.times_s.back() < usual_end - slack);
    if (is_short) found.push_back(names[i] + " (" + length_of(run) + ")");
  }
  if (found.empty()) return std::nullopt;
  return "fewer states or an earlier end than most runs (" + std::to_string(usual_count) + " states up to " +
         in_seconds(usual_end) + "): " + listed(found) + "; are they complete?";
}

std::optional<std::string> odd_times(const Survey& survey, const std::vector<std::string>& names) {
  constexpr double latest = 0.1, longest = 3;  // of the usual duration
  std::vector<double> begins, durations;
  for (const RunSurvey& run : survey.runs) {
    if (run.steps.empty()) continue;
    begins.push_back(run.times_s.front());
    durations.push_back(run.times_s.back() - run.times_s.front());
  }
  if (begins.empty()) return std::nullopt;
  const double usual_begin = median(begins), usual = median(durations);
  std::vector<std::string> found;
  for (std::size_t i = 0; i < survey.runs.size() && usual > 0; ++i) {
    const std::vector<double>& times = survey.runs[i].times_s;
    if (times.empty()) continue;
    if (std::abs(times.front() - usual_begin) > latest * usual || times.back() - times.front() > longest * usual)
      found.push_back(names[i] + " (" + in_seconds(times.front()) + " to " + in_seconds(times.back()) + ")");
  }
  if (found.empty()) return std::nullopt;
  return "other times than most runs (" + in_seconds(usual_begin) + " to " + in_seconds(usual_begin + usual) +
         "): " + listed(found) + "; check their time unit, and that time 0 is the impact in all runs";
}

std::optional<std::string> missing_last(const Survey& survey, const std::vector<std::string>& names,
                                        const StepSelection& selection) {
  if (!selection.list.empty() || selection.last == StepSelection{}.last) return std::nullopt;
  std::vector<std::string> found;
  for (std::size_t i = 0; i < survey.runs.size(); ++i) {
    const std::vector<std::uint32_t>& steps = survey.runs[i].steps;
    if (!steps.empty() && std::uint64_t{steps.back()} + selection.stride <= selection.last)
      found.push_back(names[i] + " (" + std::to_string(steps.back()) + ")");
  }
  if (found.empty()) return std::nullopt;
  return "the steps go up to state " + std::to_string(selection.last) +
         ", but these runs end before it: " + listed(found);
}
}  // namespace lbea::bake
