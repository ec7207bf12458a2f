#include "runtime/src/nearest_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lbea {

namespace {

constexpr std::size_t lanes = 16;

float sum(const std::array<float, lanes>& lane) noexcept {
  float total = 0;
  for (const float value : lane) total += value;
  return total;
}

}  // namespace

void BestSamples::offer(std::uint32_t sample, float distance) noexcept {
  if (!(distance < bound())) return;
  if (size_ < ranked_.size()) ++size_;
  std::size_t place = size_ - 1;
  for (; place > 0 && distance < ranked_[place - 1].distance; --place) ranked_[place] = ranked_[place - 1];
  ranked_[place] = {sample, distance};
}

void search_lbea(const ReferenceView& reference, const Positions& coefficients, BestSamples& best) noexcept {
  const std::size_t stride = coefficients.planes[0].size();
  const float *ex = coefficients.planes[0].data(), *ey = coefficients.planes[1].data(), *ez = coefficients.planes[2].data();
  const std::size_t samples = reference.coefficients.size() / (3 * stride);
  best.clear();
  for (std::size_t s = 0; s < samples; ++s) {
    const float* sx = reference.coefficients.data() + 3 * stride * s;
    const float *sy = sx + stride, *sz = sy + stride;
    std::array<float, lanes> partial{};
    bool may_enter = true;
    for (std::size_t j = 0; j < stride && may_enter; j += lanes) {  // padding adds nothing: zero minus zero
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const float dx = ex[j + lane] - sx[j + lane], dy = ey[j + lane] - sy[j + lane], dz = ez[j + lane] - sz[j + lane];
        partial[lane] += std::sqrt(dx * dx + dy * dy + dz * dz);
      }
      may_enter = sum(partial) < best.bound();  // the sum only grows
    }
    if (may_enter) best.offer(static_cast<std::uint32_t>(s), sum(partial));
  }
}

void search_vtp(const ModelView& model, const ReferenceView& reference, const Positions& corresponding, BestSamples& best) noexcept {
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
