// The formats of simulation files: one entry each, told by content.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "precompute/simulation.hpp"

namespace lbea::io {

struct SimulationFormat {
  const char* name;
  const char* what;  // which files, which states
  bool (*is_it)(const std::filesystem::path& file, std::string_view start);
  std::unique_ptr<bake::SimulationReader> (*open)(const std::filesystem::path& file);
};

/// In the order in which they are tried: those with a mark of their own before those told by their lines.
[[nodiscard]] std::span<const SimulationFormat> simulation_formats() noexcept;

}  // namespace lbea::io
