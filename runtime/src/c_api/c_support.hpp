// What the files of the C interface share: handles, errors, and structs that may grow.
#pragma once

#include "runtime/src/fit/surface_fit.hpp"

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>
#include <lbea/test_history.hpp>
#include <lbea/tracker.hpp>

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>

struct lbea_model {
  explicit lbea_model(lbea::Model m) : model(std::move(m)), length_unit(model.length_unit()) {
    for (std::uint32_t s = 0; s < model.simulations(); ++s) simulation_names.emplace_back(model.simulation_name(s));
    for (std::uint32_t p = 0; p < model.parameters(); ++p) parameter_names.emplace_back(model.parameter_name(p));
    for (std::uint32_t f = 0; f < model.fields(); ++f)
      fields.emplace_back(std::string(model.field(f).name), std::string(model.field(f).unit));
  }
  lbea::Model model;
  // Text with a zero byte at its end, which C needs and the file's text lacks.
  std::string length_unit;
  std::vector<std::string> simulation_names, parameter_names;
  std::vector<std::pair<std::string, std::string>> fields;  // name, unit
};

struct lbea_matcher {
  lbea_matcher(const lbea::Model& model, const lbea::MatcherConfig& config)
      : matcher(model, config),
        matches(std::min(config.max_matches, model.samples())),
        candidates(config.method == lbea::Method::fit ? lbea::FitSettings{}.candidates : 0),
        estimate(config.method == lbea::Method::fit ? lbea::FitSettings{}.most_combined() : 0) {}
  lbea::Matcher matcher;
  lbea::MatchResult last;  // input of lbea_tracker_update
  std::vector<lbea_match> matches, candidates;
  std::vector<lbea_weighted_sample> estimate;
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

inline constexpr std::string_view size_not_set =
    "struct_size is not the size of the struct; set it to sizeof, or call the init function";

// Structs that may grow: an older caller passes a smaller one than this library knows, a newer caller a larger one.

// A struct_size that was never set is usually larger than any struct will ever be.
inline constexpr std::uint32_t largest_c_struct = 4'096;

/// `least` is the struct's size in the first version that had it.
inline bool is_plausible_size(std::uint32_t struct_size, std::size_t least) noexcept {
  return struct_size >= least && struct_size <= largest_c_struct;
}

/// Writes the fields of `full` that the caller knows, and zeros into those that this library does not know.
template <typename T>
void write_c_struct(const T& full, T* out) noexcept {
  const std::uint32_t size = out->struct_size;
  const std::size_t shared = std::min<std::size_t>(size, sizeof(T));
  auto* bytes = reinterpret_cast<unsigned char*>(out);
  std::memcpy(bytes, &full, shared);
  std::memset(bytes + shared, 0, size - shared);
  out->struct_size = size;
}

/// Reads the fields that the caller set into `full`, which holds the defaults. False when the caller set a field that
/// this library does not know.
template <typename T>
bool read_c_struct(const T* in, T& full) noexcept {
  const std::size_t shared = std::min<std::size_t>(in->struct_size, sizeof(T));
  const auto* bytes = reinterpret_cast<const unsigned char*>(in);
  std::memcpy(&full, bytes, shared);
  return std::all_of(bytes + shared, bytes + in->struct_size, [](unsigned char byte) { return byte == 0; });
}
}  // namespace lbea
