// Which pipelines are measured, and the check of their answers.
#pragma once

#include "tools/bench/measurement.hpp"

namespace lbea::tool::bench {

struct Selection {
  MatcherConfig matcher;
  FitExtras extras;                    // with Method::fit
  std::string kernels_name;            // of the product; empty: the fastest
  std::vector<std::string> baselines;  // nanoflann, portable, lbea
};

/// Throws Error{bad_config} for what cannot be measured.
void check(const Selection& selection, const Model& model);
/// The product first.
[[nodiscard]] std::vector<std::unique_ptr<Pipeline>> make_pipelines(const Selection& selection, const Model& model);

/// Throws Error{bad_config} with the model's fields.
[[nodiscard]] std::uint32_t field_named(const Model& model, const std::string& name);

/// Compares all answers with double precision. Nothing: one is wrong, which was printed. Returns the number of clouds
/// without a check of method fit's candidates, because something hides a part of the component.
[[nodiscard]] std::optional<std::size_t> check_answers(Pipelines pipelines, const Model& model,
                                                       const MatcherConfig& config, std::span<const BenchCloud> clouds);

}  // namespace lbea::tool::bench
