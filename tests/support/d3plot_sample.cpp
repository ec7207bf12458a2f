#include "tests/support/d3plot_writer.hpp"

namespace lbea::test {
namespace {

/// Differs for every argument and is exact in single precision.
double value(std::size_t state, std::size_t element, std::size_t point, std::size_t component) {
  const std::size_t mixed = state * 7919 + element * 104'729 + point * 1'299'709 + component * 15'485'863;
  return static_cast<double>(mixed % 4093) / 1024.0;
}

D3plotPoint point(const D3plot& d, std::size_t state, std::size_t element, std::size_t index) {
  D3plotPoint result;
  for (std::size_t c = 0; c < 6; ++c) result.stress[c] = value(state, element, index, c) - 2;
  result.plastic_strain = value(state, element, index, 6);
  for (std::size_t h = 0; h < d.history; ++h) result.history.push_back(value(state, element, index, 7 + h));
  return result;
}

D3plotShellResult shell(const D3plot& d, std::size_t state, std::size_t element) {
  D3plotShellResult result;
  for (std::size_t layer = 0; layer < d.layers; ++layer) result.layers.push_back(point(d, state, element, layer));
  result.thickness = value(state, element, 90, 0);
  result.internal_energy = value(state, element, 90, 1);
  for (std::size_t surface = 0; surface < 2; ++surface)
    for (std::size_t c = 0; c < 6; ++c) result.strain[surface][c] = value(state, element, 91 + surface, c) - 2;
  return result;
}

}  // namespace

void fill_states(D3plot& d, std::size_t states) {
  d.states.clear();
  for (std::size_t s = 0; s < states; ++s) {
    D3plotState state;
    state.time = 0.0005 * static_cast<double>(s);
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
      state.positions.push_back(d.nodes[n]);
      for (std::size_t c = 0; c < 3 && s > 0; ++c) state.positions.back()[c] += value(s, n, 80, c);
      state.node_flags.push_back(s > 0 && n == 0 ? 0 : 1);
    }
    for (std::size_t e = 0; e < d.shells.size(); ++e) {
      state.shells.push_back(shell(d, s, e));
      state.shell_flags.push_back(s > 0 && e == 0 ? 0 : 2);
    }
    for (std::size_t e = 0; e < d.solids.size(); ++e) {
      state.solids.emplace_back();
      for (std::size_t p = 0; p < d.solid_points; ++p) state.solids.back().push_back(point(d, s, 1000 + e, p));
      state.solid_flags.push_back(s > 1 && e == 1 ? 0 : 1);
    }
    d.states.push_back(state);
  }
}

D3plot sample_d3plot(std::size_t states) {
  D3plot d;
  for (std::uint32_t y = 0; y < 3; ++y)
    for (std::uint32_t x = 0; x < 3; ++x) d.nodes.push_back({1.0 * x, 1.0 * y, 0.25 * x * x});
  d.nodes.push_back({3, 0.5, 2});
  d.shells = {{0, 1, 4, 3}, {1, 2, 5, 4}, {3, 4, 7, 6}, {4, 5, 8, 7}, {2, 9, 5, 5}};
  d.shell_parts = {1, 1, 2, 2, 1};

  for (const double z : {0.0, 1.0}) d.nodes.insert(d.nodes.end(), {{10, 0, z}, {11, 0, z}, {11, 1, z}, {10, 1, z}});
  d.nodes.insert(d.nodes.end(), {{12, 0.5, 0}, {12, 0.5, 1}, {11.25, 0.5, -1}});
  d.nodes.push_back({500, 500, 500});  // belongs to no element
  d.solids = {{10, 11, 12, 13, 14, 15, 16, 17}, {11, 12, 16, 15, 18, 18, 19, 19}, {11, 12, 18, 20, 20, 20, 20, 20}};
  d.solid_parts = {3, 3, 4};

  d.parts = 4;
  d.part_ids = {100, 200, 300, 400};
  d.material_types = {24, 20, 24, 24};
  for (std::size_t n = 0; n < d.nodes.size(); ++n) d.node_ids.push_back(static_cast<int>(1000 + 3 * n));
  d.shell_ids = {51, 52, 53, 60, 61};
  d.solid_ids = {7, 8, 9};
  fill_states(d, states);
  return d;
}

std::map<std::string, D3plot> d3plot_corpus() {
  std::map<std::string, D3plot> corpus;
  corpus["plain"] = sample_d3plot(2);
  corpus["geometry"] = sample_d3plot(0);
  D3plot rigid = sample_d3plot(1);
  rigid.ndim = 7;
  rigid.word_bytes = 8;
  rigid.has_extra = rigid.has_strain = true;
  corpus["rigid_double"] = rigid;
  D3plot rich = sample_d3plot(1);
  rich.extra_words = 16;
  rich.it = 12;
  rich.iv = 1;
  rich.layers = 2;
  rich.has_stress = true;
  rich.beams = rich.thick_shells = 1;
  rich.deletion = D3plot::Deletion::nodes;
  fill_states(rich, 1);
  corpus["rich"] = rich;
  D3plot histories = sample_d3plot(1);
  histories.globals = 6 + 7 * histories.parts + 4;  // one rigid wall
  corpus["histories"] = histories;
  return corpus;
}

}  // namespace lbea::test
