#include "runtime/src/match/nearest_samples.hpp"

#include "runtime/src/kernels/kernels.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {

void BestSamples::offer(std::uint32_t sample, float distance) noexcept {
  constexpr float farthest = std::numeric_limits<float>::max();
  const auto is_before = [&](const RankedSample& other) {
    return distance < other.distance || (distance == other.distance && sample < other.sample);
  };
  if (!(distance <= farthest)) distance = farthest;
  if (size_ == ranked_.size() && !is_before(ranked_.back())) return;
  if (size_ < ranked_.size()) ++size_;
  std::size_t place = size_ - 1;
  for (; place > 0 && is_before(ranked_[place - 1]); --place) ranked_[place] = ranked_[place - 1];
  ranked_[place] = {sample, distance};
}

void search_lbea(const ReferenceView& reference, const Positions& coefficients, BestSamples& best) noexcept {
  const Kernels& code = kernels();
  const std::size_t stride = coefficients.planes[0].size();
  const float* const e[3] = {coefficients.planes[0].data(), coefficients.planes[1].data(),
                             coefficients.planes[2].data()};
  const std::size_t samples = reference.coefficients.size() / (3 * stride);
  best.clear();
  for (std::size_t s = 0; s < samples; ++s) {
    const float* sample = reference.coefficients.data() + 3 * stride * s;
    best.offer(static_cast<std::uint32_t>(s), code.mode_distance(e, sample, stride, best.bound()));
  }
}

void search_vtp(const ModelView& model, const ReferenceView& reference, const Positions& corresponding,
                BestSamples& best) noexcept {
  const std::size_t n = corresponding.count, nodes = model.info.nodes;
  constexpr std::size_t block = 64;
  best.clear();
  for (std::size_t s = 0; s < model.info.samples; ++s) {
    const float* node_positions = model.node_positions.data() + 3 * nodes * s;
    const std::uint32_t* node = reference.correspondence.data() + n * s;
    const float bound = best.bound() * static_cast<float>(n);
    float total = 0;
    for (std::size_t begin = 0; begin < n && total <= bound; begin += block)
      for (std::size_t i = begin; i < std::min(begin + block, n); ++i) {
        const float* sample = node_positions + std::size_t{3} * node[i];
        const auto [x, y, z] = corresponding[i];
        const float dx = x - sample[0], dy = y - sample[1], dz = z - sample[2];
        total += std::sqrt(dx * dx + dy * dy + dz * dz);
      }
    best.offer(static_cast<std::uint32_t>(s), total / static_cast<float>(n));
  }
}

}  // namespace lbea
