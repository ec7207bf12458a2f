// A patch that erodes late in some runs: the model keeps it, and each sample has it or not.
#include "precompute/depth_images/learned_fit.hpp"
#include "precompute/jobs/jobs.hpp"
#include "precompute/survey/surface_continuation.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/eroding_plates.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr std::uint32_t steps = 6, from = 4, pairs = 3;

ChannelDescription strain_channel(const std::string& name, ChannelKind kind) {
  ChannelDescription channel;
  channel.name = name;
  channel.kind = kind;
  channel.field = "plastic_strain";
  return channel;
}

/// Baked once for all cases.
const AlignedBytes& eroding_model() {
  static const AlignedBytes bytes = [] {
    EnsembleDescription description = bent_plates_description();
    description.channels.push_back(strain_channel("largest", ChannelKind::maximum));
    const TemporaryFolder folder;
    bake_model(eroding_plates(pairs, steps, from), description, folder / "m.lbea", with_views());
    return AlignedBytes(folder / "m.lbea");
  }();
  return bytes;
}

bool has_hole(const Sample& sample) { return sample.simulation % 2 == 1 && sample.time_step >= from; }

bool is_in(const std::vector<std::size_t>& list, std::size_t value) {
  return std::ranges::find(list, value) != list.end();
}

/// Per node, the nodes beside it along the sides of elements, each as often as it is.
std::map<std::uint32_t, std::vector<std::uint32_t>> neighbors_in(const SimulationMesh& mesh) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> neighbors;
  for (const Quad& q : mesh.elements)
    for (std::size_t i = 0; i < 4; ++i) {
      neighbors[q[i]].push_back(q[(i + 1) % 4]);
      neighbors[q[(i + 1) % 4]].push_back(q[i]);
    }
  return neighbors;
}

/// Without any other run.
CommonMesh common_mesh_of(const SimulationMesh& mesh) {
  return {mesh.node_ids, mesh.elements, mesh.element_ids, mesh.element_parts};
}

void continue_surface(const SimulationMesh& mesh, SimulationState& state, const SimulationMesh* reference = nullptr) {
  const CommonMesh common = common_mesh_of(mesh);
  SurfaceContinuation(mesh, common, map_common(common, mesh, "a"), reference).apply(state);
}

std::size_t filled_cells(const SensorViews& views, std::uint32_t sample) {
  const std::vector<float> image = views.depth_image(sample);
  return static_cast<std::size_t>(std::ranges::count_if(image, [](float depth) { return !std::isnan(depth); }));
}

std::vector<Point> frame_of(const SimulationState& state) {
  const SimulationMesh mesh = plate_mesh();
  return VirtualSensor(rig_above(), mesh.nodes(), mesh.elements).sense({state.positions, state.alive}, {}, 1);
}

MatchResult matched(Matcher& matcher, const std::vector<Point>& points) {
  Frame frame{};
  frame.points = points;
  return matcher.match(frame);
}

}  // namespace

TEST_CASE("the displacement of a free node is the mean of its neighbors', others stay bit for bit") {
  const SimulationMesh mesh = plate_mesh();
  SimulationState state = bent_state(mesh, 0, 1.2, 190);
  erode_patch(state);
  const std::vector<float> before = state.positions;
  continue_surface(mesh, state);
  const auto neighbors = neighbors_in(mesh);
  const auto moved = [&](std::size_t node, std::size_t axis) {
    return double{state.positions[3 * node + axis]} - double{mesh.positions[3 * node + axis]};
  };
  for (std::uint32_t node = 0; node < mesh.nodes(); ++node)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!is_in(patch_nodes(), node)) {
        REQUIRE(state.positions[3 * node + axis] == before[3 * node + axis]);
        continue;
      }
      double sum = 0;
      for (const std::uint32_t neighbor : neighbors.at(node)) sum += moved(neighbor, axis);
      // Positions of up to 190 mm are rounded by up to 190 * 2^-24.
      CHECK(moved(node, axis) ==
            doctest::Approx(sum / static_cast<double>(neighbors.at(node).size())).scale(1).epsilon(3e-5));
    }
}

TEST_CASE("nodes without any connection to a living one move with the mean of those that live") {
  SimulationMesh mesh = plate_mesh({8, 5, 70, 40});
  const auto nodes = static_cast<std::uint32_t>(mesh.nodes());
  for (const float x : {200.0f, 210.0f})
    for (const float y : {0.0f, 10.0f}) mesh.positions.insert(mesh.positions.end(), {x, y, 0});
  for (std::uint32_t i = 0; i < 4; ++i) mesh.node_ids.push_back(5000 + i);
  mesh.elements.push_back({nodes, nodes + 2, nodes + 3, nodes + 1});
  mesh.element_ids.push_back(9000);
  mesh.element_parts.push_back(9);
  SimulationState state = bent_state(mesh, 0, 0, 70);
  for (std::size_t i = 0; i < mesh.nodes(); ++i) state.positions[3 * i + 1] += i < nodes ? 7.0f : 500.0f;
  const std::vector<float> apart = state.positions;
  const CommonMesh common = common_mesh_of(mesh);
  SurfaceContinuation continuation(mesh, common, map_common(common, mesh, "a"));
  continuation.apply(state);
  CHECK(state.positions == apart);  // nothing erodes
  state.alive.back() = 0;
  continuation.apply(state);
  for (std::size_t i = 0; i < mesh.nodes(); ++i) CHECK(state.positions[3 * i + 1] == mesh.positions[3 * i + 1] + 7);
}

TEST_CASE("free nodes that the common mesh lacks stay as they are") {
  const SimulationMesh mesh = plate_mesh();
  SimulationState state = bent_state(mesh, 0, 1.2, 190);
  erode_patch(state);
  const std::vector<float> before = state.positions;
  CommonMeshBuilder builder(mesh, "a");
  std::vector<Presence> present(mesh.elements.size(), Presence::always);
  const auto middle = static_cast<std::uint32_t>(patch_nodes()[4]);
  for (std::size_t e = 0; e < present.size(); ++e)
    if (std::ranges::find(mesh.elements[e], middle) != mesh.elements[e].end()) present[e] = Presence::missing;
  builder.keep(present, "a");
  const CommonMesh common = builder.finish();
  SurfaceContinuation(mesh, common, map_common(common, mesh, "a")).apply(state);
  for (const std::size_t node : patch_nodes())
    CHECK((state.positions[3 * node + 2] == before[3 * node + 2]) == (node == middle));
}

TEST_CASE("positions of free nodes may be any number or none; those of others may not") {
  const auto with = [](std::size_t node, float value) {
    Ensemble ensemble = eroding_plates(1, steps, from);
    ensemble.runs[1].open = [=] {
      SyntheticSimulation plate = eroding_plate(0.5, steps, from);
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      for (std::uint32_t step = from; step < steps; ++step) std::fill_n(&states[step].positions[3 * node], 3, value);
      return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
    };
    return ensemble;
  };
  const auto baked = [&](const Ensemble& ensemble) {
    const TemporaryFolder folder;
    bake_model(ensemble, bent_plates_description(), folder / "m.lbea", with_views());
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes expected_bytes = baked(eroding_plates(1, steps, from));
  const Model expected = Model::view(expected_bytes.span());
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float value : {nan, infinity, 1e30f}) {
    const AlignedBytes bytes = baked(with(patch_nodes()[4], value));
    const Model model = Model::view(bytes.span());
    for (std::uint32_t s = 0; s < model.samples(); ++s)
      CHECK(std::ranges::equal(model.node_positions(s), expected.node_positions(s)));
    check_error(error_of([&] { (void)baked(with(0, value)); }), Status::bad_input, {"run eroding_0, state 4", "node"});
  }
}

TEST_CASE("undeformed places that a run lacks are the reference run's, or else continue those around") {
  SimulationMesh mesh = plate_mesh();
  const std::vector<float> flat = mesh.positions;
  for (const std::size_t node : patch_nodes()) mesh.positions[3 * node + 2] += 3;  // a bead
  SimulationMesh reference = mesh, lacking = mesh;
  for (std::size_t i = 0; i < reference.positions.size(); i += 3) reference.positions[i] += 20;  // starts elsewhere
  lacking.guessed.assign(mesh.nodes(), 0);
  for (const std::size_t node : patch_nodes()) lacking.guessed[node] = 1, lacking.positions[3 * node] = 500;
  SimulationMesh lacking_reference = reference;
  lacking_reference.guessed = lacking.guessed;
  const auto check = [&](const SimulationMesh* other, const std::vector<float>& places) {
    SimulationState state = bent_state(mesh, 0, 0, 190);
    for (std::size_t i = 1; i < state.positions.size(); i += 3) state.positions[i] += 7;
    erode_patch(state);
    continue_surface(lacking, state, other);
    for (std::size_t i = 0; i < state.positions.size(); ++i)  // of up to 210 mm, rounded three times by 210 * 2^-24
      CHECK(state.positions[i] == doctest::Approx(places[i] + (i % 3 == 1 ? 7 : 0)).scale(1).epsilon(1e-4));
  };
  check(&reference, mesh.positions);
  for (const SimulationMesh* other : {static_cast<const SimulationMesh*>(nullptr), &std::as_const(lacking)})
    check(other, flat);  // linear coordinates on a regular grid are harmonic
  check(&lacking_reference, flat);
}

TEST_CASE("a run that never has the patch is baked as if its files had the undeformed mesh") {
  const auto baked = [](bool lacks_places) {
    Ensemble ensemble = eroding_plates(1, steps, 0);
    ensemble.runs[1].open = [=] {
      SyntheticSimulation plate = eroding_plate(0.5, steps, 0);
      SimulationMesh mesh = plate.mesh();
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      if (lacks_places) mesh.guessed.assign(mesh.nodes(), 0);
      for (const std::size_t node : patch_nodes())
        if (lacks_places) mesh.guessed[node] = 1, std::fill_n(&mesh.positions[3 * node], 3, -40.0f);
      return std::make_unique<SyntheticSimulation>(mesh, states, plate.fields());
    };
    const TemporaryFolder folder;
    bake_model(ensemble, bent_plates_description(), folder / "m.lbea");
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes expected_bytes = baked(false), bytes = baked(true);
  const Model expected = Model::view(expected_bytes.span()), model = Model::view(bytes.span());
  REQUIRE(model.nodes() == 200);
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); ++i)  // rounded twice more by 190 * 2^-24
      REQUIRE(model.node_positions(s)[i] == doctest::Approx(expected.node_positions(s)[i]).scale(1).epsilon(1e-4));
}

TEST_CASE("a patch that some runs lose stays in the model; samples without it say so") {
  const Model model = Model::view(eroding_model().span());
  CHECK(model.elements() == 171);
  CHECK(model.vertices() == 200);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const std::vector<std::uint8_t> present = present_elements(model, s);
    REQUIRE(present.size() == model.elements());
    for (std::size_t e = 0; e < model.elements(); ++e) {
      const bool is_eroded = has_hole(model.sample(s)) && is_in(patch_elements(), e);
      REQUIRE((present[e] == 0) == is_eroded);
      REQUIRE(std::isnan(model.field_values(0, s)[e]) == is_eroded);
    }
  }
}

TEST_CASE("elements that all of some samples have are those that none of them lacks") {
  const Model model = Model::view(eroding_model().span());
  const std::uint32_t whole = model.sample_index({0, steps - 1}), eroding = model.sample_index({1, steps - 1});
  for (const std::vector<std::uint32_t>& samples :
       std::vector<std::vector<std::uint32_t>>{{whole}, {whole, eroding}, {eroding, whole}, {}}) {
    const std::vector<std::uint8_t> present = present_in_all(model, samples);
    const bool has_eroding = std::ranges::find(samples, eroding) != samples.end();
    REQUIRE(present.size() == model.elements());
    for (std::size_t e = 0; e < model.elements(); ++e)
      REQUIRE((present[e] == 0) == (has_eroding && is_in(patch_elements(), e)));
  }
}

TEST_CASE("free nodes that fly 1 m away move neither positions, envelope nor coefficients") {
  const Model model = Model::view(eroding_model().span());
  const auto plane = static_cast<std::size_t>(format::padded(model.modes()));
  double largest = 0;
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    if (!has_hole(model.sample(s))) continue;
    const std::uint32_t twin = model.sample_index({model.sample(s).simulation - 1, model.sample(s).time_step});
    for (std::size_t i = 0; i < 3 * std::size_t{model.nodes()}; ++i) {
      const float off = model.node_positions(s)[i] - model.node_positions(twin)[i];
      if (!is_in(patch_nodes(), i / 3)) REQUIRE(off == 0);
      CHECK(std::abs(off) < 1);  // measured 0.1: the bent plate is nearly harmonic there
    }
    // The projection is orthogonal in the inner product of M. The nearest node that is left is at most two edges of
    // 10 mm away from the nine vertices, each of which has the mass of an element, 100 mm^2; in the bent plate vertices
    // correspond to other nodes than their own, up to all of them.
    const auto of = [&](std::uint32_t sample) {
      return model.view().references[0].coefficients.subspan(3 * plane * sample, 3 * plane);
    };
    double squares = 0;
    for (std::size_t i = 0; i < 3 * plane; ++i) squares += std::pow(double{of(s)[i]} - double{of(twin)[i]}, 2);
    largest = std::max(largest, std::sqrt(squares));
  }
  CHECK(largest > 0);
  CHECK(largest <= 20 * std::sqrt(2 * 9 * 100.0));
  const auto& envelope = model.view().envelope;
  CHECK(static_cast<double>(envelope.corner[2] + envelope.cell * static_cast<float>(envelope.cells[2])) < 200);
}

TEST_CASE("depth images have the hole in the samples that have it, also those that are rendered later") {
  const Model model = Model::view(eroding_model().span());
  const SensorViews baked = SensorViews::baked_into(model);
  std::vector<Quad> elements(model.elements());
  for (std::size_t i = 0; i < model.element_nodes().size(); ++i) elements[i / 4][i % 4] = model.element_nodes()[i];
  const auto& survey = model.view().depth_images->camera;
  std::array<float, 3> low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); ++i) {
      low[i % 3] = std::min(low[i % 3], model.node_positions(s)[i]);
      high[i % 3] = std::max(high[i % 3], model.node_positions(s)[i]);
    }
  const auto renderer = make_depth_renderer(rig_above(), model.nodes(), elements, low, high);
  REQUIRE(renderer->camera().columns == survey.columns);
  const SensorViews rendered = render_depth_images(model, *renderer, 0);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto [simulation, step] = model.sample(s);
    const std::uint32_t twin = model.sample_index({simulation ^ 1, step});
    const std::size_t filled = filled_cells(baked, s), of_twin = filled_cells(baked, twin);
    if (has_hole({simulation, step}))
      CHECK(filled + 10 < of_twin);
    else if (!has_hole({simulation ^ 1, step}))
      CHECK(filled == of_twin);
    CHECK(filled_cells(rendered, s) == filled);
  }
}

TEST_CASE("the images of further rigs have the hole, too") {
  BakeOptions options = with_views();
  options.more_depth_renderers.push_back(options.depth_renderer);
  const TemporaryFolder folder;
  bake_model(eroding_plates(2, steps, from), bent_plates_description(), folder / "m.lbea", options);
  const Model model = Model::open(folder / "m.lbea");
  REQUIRE(model.view().more_depth_images.size() == 1);
  CHECK(std::ranges::equal(model.view().depth_images->depths, model.view().more_depth_images[0]->depths));
}

TEST_CASE("a frame with the hole is matched to the run that has it, one without to its twin") {
  const Model model = Model::view(eroding_model().span());
  Matcher matcher(model, fit_config());
  for (const std::uint32_t pair : {0u, 2u})
    for (const bool erodes : {false, true}) {
      SimulationState state;
      eroding_plate(0.5 + 0.1 * pair, steps, erodes ? from : steps).read(steps - 1, state);
      const MatchResult result = matched(matcher, frame_of(state));
      REQUIRE(result.status == Status::ok);
      REQUIRE(!result.fit.candidates.empty());
      CHECK(result.fit.candidates.front().sample == Sample{2 * pair + (erodes ? 1u : 0u), steps - 1});
    }
}

TEST_CASE("an estimate has lost an element when samples with at least half of the weight have") {
  const Model model = Model::view(eroding_model().span());
  const Sample whole{2, steps - 1}, eroding{3, steps - 1};
  const std::size_t element = patch_elements()[5];
  const float value = model.field_values(0, model.sample_index(whole))[element];
  for (const float weight : {0.25f, 0.5f, 0.75f}) {
    const std::vector<WeightedSample> estimate{{whole, 1 - weight}, {eroding, weight}};
    Inferred inferred;
    infer_field(model, 0, estimate, estimate, inferred);
    CHECK(std::isnan(inferred.mean[element]) == (weight >= 0.5f));
    if (weight < 0.5f) CHECK(inferred.mean[element] == value);
    CHECK_FALSE(std::isnan(inferred.mean[0]));
    CHECK_FALSE(std::isnan(inferred.spread[0]));
  }
}

TEST_CASE("the estimate of an unseen run has lost what similar runs have lost") {
  Ensemble ensemble;
  const auto erodes_from = [](double angle) { return angle > 0.85 ? from : steps; };  // those that bend far
  for (std::uint32_t run = 0; run < 8; ++run) {
    const double angle = 0.5 + 0.1 * run;
    ensemble.runs.push_back({"plate_" + std::to_string(run), {}, [=] {
                               return std::make_unique<SyntheticSimulation>(
                                   eroding_plate(angle, steps, erodes_from(angle)));
                             }});
  }
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(), folder / "m.lbea", with_views());
  const Model model = Model::open(folder / "m.lbea");
  Matcher matcher(model, fit_config());
  for (const double angle : {0.65, 0.75, 1.05, 1.15}) {
    SimulationState state;
    eroding_plate(angle, steps, erodes_from(angle)).read(steps - 1, state);
    const MatchResult result = matched(matcher, frame_of(state));
    Inferred inferred;
    infer_field(model, 0, result.fit, inferred);
    CAPTURE(angle);
    CHECK(std::isnan(inferred.mean[patch_elements()[5]]) == (erodes_from(angle) == from));
    CHECK_FALSE(std::isnan(inferred.mean[0]));
  }
}

TEST_CASE("fields of eroded elements do not count in channels") {
  const Model model = Model::view(eroding_model().span());
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    float largest = 0;
    for (const float value : model.field_values(0, s)) largest = std::max(largest, value);  // NaN is not larger
    CHECK(model.channel_value(0, s) == largest);
    CHECK(largest < 10);
  }
  EnsembleDescription description = bent_plates_description();
  description.channels.push_back(strain_channel("patch", ChannelKind::mean));
  for (const std::size_t element : patch_elements())
    description.channels[0].elements.push_back(plate_mesh().element_ids[element]);
  const TemporaryFolder folder;
  check_error(error_of([&] { bake_model(eroding_plates(1, steps, from), description, folder / "m.lbea"); }),
              Status::bad_input, {"run eroding_0, state 4", "all elements of channel 'patch' are eroded"});
}

TEST_CASE("channels of nodes that a run loses are refused, before a shard is baked, too") {
  const auto id_of = [](std::size_t node) { return plate_mesh().node_ids[node]; };
  const ChannelPoint inner{true, id_of(patch_nodes()[4]), {}}, corner{true, id_of(0), {}}, beside{true, id_of(1), {}},
      above{true, id_of(PlateShape{}.columns), {}};
  const std::string node = "node " + std::to_string(inner.node) + ", which flies freely in run eroding_0, state 4";
  const std::vector<ChannelDescription> refused{
      {"moved", ChannelKind::displacement, ChannelComponent::z, 0, {inner}, {}},
      {"fast", ChannelKind::velocity, ChannelComponent::z, 150, {inner}, {}},
      {"far", ChannelKind::distance, ChannelComponent::resultant, 0, {corner, inner}, {}},
      {"deep", ChannelKind::intrusion, ChannelComponent::z, 0, {above, corner, beside, inner}, {}}};
  for (const ChannelDescription& channel : refused) {
    EnsembleDescription description = bent_plates_description();
    description.channels = {channel};
    const TemporaryFolder folder;
    const WorkFolder work(folder / "work");
    const std::string name = "channel '" + channel.name + "'";
    BakeOptions options;
    options.leaves_out_broken = true;
    check_error(error_of([&] { bake_model(eroding_plates(1, steps, from), description, folder / "m.lbea", options); }),
                Status::bad_config, {name.c_str(), node.c_str(), "choose another node"});
    check_error(error_of([&] { (void)plan_bake(work, eroding_plates(1, steps, from), description, options); }),
                Status::bad_config, {name.c_str(), node.c_str()});
  }
}

TEST_CASE("a channel ends with its node: later states, which are not used, do not reach back into it") {
  constexpr std::uint32_t long_steps = 9, late = 6;
  ChannelDescription channel{"fast", ChannelKind::velocity, ChannelComponent::z, 150, {}, {}};
  channel.points = {{true, plate_mesh().node_ids[patch_nodes()[4]], {}}};
  EnsembleDescription description = bent_plates_description();
  description.channels = {channel};
  description.steps.last = late - 1;
  Ensemble cut = eroding_plates(1, long_steps, late);
  cut.runs[1].open = [] {
    SyntheticSimulation whole = eroding_plate(0.5, long_steps, late);
    std::vector<SimulationState> states(late);
    for (std::uint32_t step = 0; step < late; ++step) whole.read(step, states[step]);
    return std::make_unique<SyntheticSimulation>(whole.mesh(), std::move(states), whole.fields());
  };
  const TemporaryFolder folder;
  bake_model(eroding_plates(1, long_steps, late), description, folder / "eroding.lbea");
  bake_model(cut, description, folder / "cut.lbea");
  const Model eroding = Model::open(folder / "eroding.lbea"), expected = Model::open(folder / "cut.lbea");
  REQUIRE(eroding.samples() == 2 * late);
  for (std::uint32_t s = late; s < eroding.samples(); ++s)
    CHECK(eroding.channel_value(0, s) == expected.channel_value(0, s));
}

TEST_CASE("the region has the elements of all reference meshes; the component keeps the others") {
  Ensemble ensemble = eroding_plates(1, steps, from);
  ensemble.reference_run = 1;
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(ReferenceMode::over_time), folder / "m.lbea");
  const Model over_time = Model::open(folder / "m.lbea");
  CHECK(over_time.elements() == 171);
  CHECK(over_time.vertices() == 200 - 9);
  bake_model(ensemble, bent_plates_description(), folder / "m.lbea");
  CHECK(Model::open(folder / "m.lbea").vertices() == 200);
}

TEST_CASE("a model of runs without erosion has no section for it; other sections of runs that do not erode are equal") {
  const auto bytes_of = [](std::uint32_t eroded_from) {
    const TemporaryFolder folder;
    bake_model(eroding_plates(2, steps, eroded_from), bent_plates_description(), folder / "m.lbea");
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes whole_bytes = bytes_of(steps), eroding_bytes = bytes_of(from);
  const Model whole = Model::view(whole_bytes.span()), eroding = Model::view(eroding_bytes.span());
  CHECK(whole.view().eroded.empty());
  CHECK(present_elements(whole, 0).empty());
  CHECK_FALSE(eroding.view().eroded.empty());
  CHECK(std::ranges::equal(whole.view().references[0].projection, eroding.view().references[0].projection));
  for (std::uint32_t s = 0; s < whole.samples(); ++s)
    if (!has_hole(whole.sample(s))) CHECK(std::ranges::equal(whole.node_positions(s), eroding.node_positions(s)));
}

TEST_CASE("a damaged section of eroded elements is refused") {
  const auto refused_after = [](const auto& change) {
    AlignedBytes bytes = eroding_model();
    forge(bytes.span(), format::SectionId::eroded_elements, change);
    return status_of(bytes.span()) == Status::corrupt_model;
  };
  using format::SectionEntry;
  CHECK_FALSE(refused_after([](SectionEntry&, std::span<std::byte> section) { set<std::uint32_t>(section, 0, 7); }));
  CHECK(refused_after(
      [](SectionEntry&, std::span<std::byte> section) { set<std::uint32_t>(section, 5, 1u << 171 % 32); }));
  CHECK(refused_after([](SectionEntry& entry, std::span<std::byte>) { entry.shape = {entry.shape[0] * 6, 1, 1}; }));
  CHECK(refused_after([](SectionEntry& entry, std::span<std::byte>) { entry.element_type = 4; }));
}

TEST_CASE("states without any element, and runs that lose more than half of them, are named") {
  const auto with_last = [](std::size_t eroded) {
    Ensemble ensemble = eroding_plates(1, steps, steps);
    ensemble.runs[1].open = [eroded] {
      SyntheticSimulation plate = bending_plate(0.5, steps);
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      std::fill_n(states.back().alive.begin(), eroded, std::uint8_t{0});
      return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
    };
    return ensemble;
  };
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  check_error(error_of([&] { (void)plan_bake(work, with_last(171), bent_plates_description(), {}); }),
              Status::bad_input, {"run eroding_0, state 5: all elements are eroded"});
  BakeOptions leaving_out;
  leaving_out.leaves_out_broken = true;
  const BakeSummary without = bake_model(with_last(171), bent_plates_description(), folder / "m.lbea", leaving_out);
  CHECK(without.losses.eroding == 0);
  CHECK(without.losses.runs.empty());
  const auto warned = [](const BakeSummary& summary) {
    return std::ranges::any_of(summary.warnings, [](const std::string& warning) {
      return contains(warning, "run eroding_0: 100 of its 171 elements are eroded in state 5");
    });
  };
  CHECK(warned(bake_model(with_last(100), bent_plates_description(), folder / "m.lbea")));
  CHECK_FALSE(warned(bake_model(with_last(80), bent_plates_description(), folder / "m.lbea")));
}

TEST_CASE("a run that fails after the plan does not count as eroding") {
  Ensemble ensemble = eroding_plates(1, steps, from);
  const auto fails = std::make_shared<bool>(false);
  ensemble.runs[1].open = [=, open = ensemble.runs[1].open] {
    if (*fails) throw Error(Status::bad_input, "the run is gone");
    return open();
  };
  BakeOptions options;
  options.leaves_out_broken = true;
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, ensemble, bent_plates_description(), options);
  CHECK(plan.survey.losses.runs == std::vector<std::string>{"eroding_0"});
  CHECK(plan.survey.losses.eroding == 16);
  *fails = true;
  bake_shard(work, plan, {0, 1}, options);
  const BakeSummary summary = merge_shards(work, plan, folder / "m.lbea", options);
  REQUIRE(summary.left_out.size() == 1);
  CHECK(summary.losses.runs.empty());
  CHECK(summary.losses.eroding == 0);
}
