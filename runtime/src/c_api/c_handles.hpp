// What is behind the opaque handles of the C interface.
#pragma once

#include "runtime/src/c_api/c_guard.hpp"
#include "runtime/src/match/surface_fit.hpp"

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>
#include <lbea/tracker.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct lbea_model {
  explicit lbea_model(lbea::Model m) : model(std::move(m)), length_unit(model.length_unit()) {
    for (std::uint32_t s = 0; s < model.simulations(); ++s) simulation_names.emplace_back(model.simulation_name(s));
    for (std::uint32_t f = 0; f < model.fields(); ++f)
      fields.emplace_back(std::string(model.field(f).name), std::string(model.field(f).unit));
  }
  lbea::Model model;
  // Text as C reads it; the file's has no zero byte at its end.
  std::string length_unit;
  std::vector<std::string> simulation_names;
  std::vector<std::pair<std::string, std::string>> fields;  // name, unit
};

struct lbea_matcher {
  lbea_matcher(const lbea::Model& model, const lbea::MatcherConfig& config)
      : matcher(model, config),
        matches(std::min(config.max_matches, model.samples())),
        candidates(config.method == lbea::Method::fit ? lbea::FitSettings{}.candidates : 0),
        estimate(candidates.size()) {}
  lbea::Matcher matcher;
  lbea::MatchResult last;  // what a tracker takes in
  std::vector<lbea_match> matches, candidates;
  std::vector<lbea_weighted_sample> estimate;
};

struct lbea_tracker {
  explicit lbea_tracker(const lbea::Model& model) : tracker(model), model_checksum(model.checksum()) {}
  lbea::Tracker tracker;
  std::uint64_t model_checksum;
};

namespace lbea {

inline lbea_status bad_argument(std::string_view sentence) noexcept { return failed(LBEA_BAD_ARGUMENT, sentence); }

inline constexpr std::string_view size_not_set =
    "struct_size is not the size of the struct; set it to sizeof, or call the init function";

}  // namespace lbea
