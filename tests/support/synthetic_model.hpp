// A small ensemble of bending plates and models baked from it. Link lbea_precompute.
#pragma once

#include "precompute/bake.hpp"
#include "tests/support/synthetic_simulation.hpp"
#include "tests/support/test_data.hpp"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace lbea::test {

using namespace lbea::bake;

struct BentPlates {
  std::uint32_t runs = 4, steps = 6;
  PlateShape shape{};  // 200 nodes, 171 elements
};

/// Radians. No angle except 0 occurs in two runs.
inline double final_angle(std::uint32_t run) { return 0.8 + 0.37 * run; }

/// Runs "plate_0", "plate_1", ... that bend to final_angle(run); parameter "final_angle [rad]".
inline Ensemble bent_plates(const BentPlates& plates = {}) {
  Ensemble ensemble;
  ensemble.parameter_names = {"final_angle [rad]"};
  for (std::uint32_t run = 0; run < plates.runs; ++run) {
    const double angle = final_angle(run);
    ensemble.runs.push_back({"plate_" + std::to_string(run), {angle}, [plates, angle] {
                               return std::make_unique<SyntheticSimulation>(
                                   bending_plate(angle, plates.steps, plates.shape));
                             }});
  }
  return ensemble;
}

/// The whole plate is the observed region; 20 modes.
inline EnsembleDescription bent_plates_description(ReferenceMode mode = ReferenceMode::impact) {
  EnsembleDescription description;
  description.mode = mode;
  description.modes = 20;
  return description;
}

inline BakeSummary bake_bent_plates(const std::filesystem::path& file, ReferenceMode mode = ReferenceMode::impact,
                                    const BentPlates& plates = {}) {
  return bake_model(bent_plates(plates), bent_plates_description(mode), file);
}

/// The bytes of a file, aligned as Model::view() requires.
class AlignedBytes {
 public:
  explicit AlignedBytes(const std::filesystem::path& file)
      : size_(static_cast<std::size_t>(std::filesystem::file_size(file))),
        lines_((size_ + sizeof(Line) - 1) / sizeof(Line)) {
    std::ifstream(file, std::ios::binary)
        .read(reinterpret_cast<char*>(lines_.data()), static_cast<std::streamsize>(size_));
  }
  [[nodiscard]] std::span<std::byte> span() { return std::as_writable_bytes(std::span(lines_)).first(size_); }
  [[nodiscard]] std::span<const std::byte> span() const { return std::as_bytes(std::span(lines_)).first(size_); }

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::size_t size_;
  std::vector<Line> lines_;
};

/// The bytes of a baked model of bending plates.
inline AlignedBytes bent_plates_model(ReferenceMode mode = ReferenceMode::impact, const BentPlates& plates = {}) {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea", mode, plates);
  return AlignedBytes(folder / "plates.lbea");
}

}  // namespace lbea::test
