// What the files of the C interface share: handles and errors.
#pragma once

#include "runtime/src/c_api/growing_structs.hpp"
#include "runtime/src/fit/surface_fit.hpp"

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>
#include <lbea/rigs.hpp>
#include <lbea/test_history.hpp>
#include <lbea/tracker.hpp>

#include <algorithm>
#include <exception>
#include <new>

struct lbea_model {
  explicit lbea_model(lbea::Model m) : model(std::move(m)), length_unit(model.length_unit()) {
    for (std::uint32_t s = 0; s < model.simulations(); ++s) simulation_names.emplace_back(model.simulation_name(s));
    for (std::uint32_t p = 0; p < model.parameters(); ++p) parameter_names.emplace_back(model.parameter_name(p));
    for (std::uint32_t f = 0; f < model.fields(); ++f)
      fields.emplace_back(std::string(model.field(f).name), std::string(model.field(f).unit));
    for (std::uint32_t c = 0; c < model.channels(); ++c)
      channels.emplace_back(std::string(model.channel(c).name), std::string(model.channel(c).unit));
  }
  lbea::Model model;
  // Text with a zero byte at its end, which C needs and the file's text lacks.
  std::string length_unit;
  std::vector<std::string> simulation_names, parameter_names;
  std::vector<std::pair<std::string, std::string>> fields, channels;  // name, unit
};

namespace lbea {
/// A matcher's last result, which trackers and forecasts take, and its lists for C.
struct CResult {
  CResult(const Model& of, std::uint32_t max_matches)
      : model(of),
        matches(std::min(max_matches, of.samples())),
        candidates(FitSettings{}.most_combined()),
        estimate(candidates.size()) {}
  /// Keeps `result` and writes it. Returns its status.
  lbea_status write(const MatchResult& result, lbea_result* into) noexcept;
  Model model;
  MatchResult last;
  std::vector<lbea_match> matches, candidates;
  std::vector<lbea_weighted_sample> estimate;
};
}  // namespace lbea

struct lbea_matcher {
  lbea_matcher(const lbea::Model& model, const lbea::MatcherConfig& config)
      : matcher(model, config), result(model, config.max_matches) {}
  lbea::Matcher matcher;
  lbea::CResult result;
};

struct lbea_rig_matcher {
  lbea_rig_matcher(const lbea::Model& model, const lbea::MatcherConfig& config, const std::vector<lbea::Rig>& rigs)
      : matcher(model, config, rigs), result(model, config.max_matches) {}
  lbea::RigMatcher matcher;
  lbea::CResult result;
};

struct lbea_test_history {
  explicit lbea_test_history(const lbea::Model& model) : history(model), model_checksum(model.checksum()) {}
  lbea::TestHistory history;
  std::uint64_t model_checksum;
};

struct lbea_tracker {
  explicit lbea_tracker(const lbea::Model& model) : tracker(model), model_checksum(model.checksum()) {}
  lbea::Tracker tracker;
  std::uint64_t model_checksum;
};

namespace lbea {
/// Stores the sentence for this thread's lbea_last_error() and returns the status. Does not allocate.
lbea_status failed(lbea_status status, std::string_view sentence) noexcept;
[[nodiscard]] const char* last_error() noexcept;

[[nodiscard]] lbea_status to_c(Status status) noexcept;

/// Calls `action` and turns an exception into a status: no exception may reach C.
template <typename Action>
lbea_status guarded(Action&& action) noexcept {
  try {
    return action();
  } catch (const Error& error) { return failed(to_c(error.status), error.what()); } catch (const std::bad_alloc&) {
    return failed(LBEA_OUT_OF_MEMORY, "out of memory; ask for fewer points or free some");
  } catch (const std::exception& error) { return failed(LBEA_INTERNAL_ERROR, error.what()); } catch (...) {
    return failed(LBEA_INTERNAL_ERROR, "an exception of unknown type; report it with lbea_build_info()");
  }
}

inline lbea_status bad_argument(std::string_view sentence) noexcept { return failed(LBEA_BAD_ARGUMENT, sentence); }

// c_matcher.cpp
/// config: null for the defaults.
lbea_status read(const lbea_config* config, MatcherConfig& into) noexcept;
/// Returns what is wrong with it, or nothing.
[[nodiscard]] std::string_view read(const lbea_frame& frame, Frame& into) noexcept;
/// LBEA_OK if `result` can be written to and `wrong` is empty; else the refusal, also in `result` if possible.
lbea_status begin_result(lbea_result* result, std::string_view wrong) noexcept;
[[nodiscard]] lbea_verdict to_c(Verdict verdict) noexcept;
}  // namespace lbea
