// A part of one of two components that leaves the space of the simulations: lbea-serve and lbea-replay name it.
#include "tests/components/plate_parts.hpp"
#include "tests/mcap/bench.hpp"

using namespace lbea::test;

namespace {

/// The nodes of both parts of a bent plate, the outer ones of the free part moved away by `apart` mm.
std::vector<lbea::Point> plate_torn_by(float apart, const std::string& clamped, const std::string& free) {
  std::vector<lbea::Point> points;
  for (const std::string& file : {clamped, free}) {
    const lbea::Model model = lbea::Model::open(file);
    const auto nodes = model.node_positions(3);  // bent, of the first run
    for (std::size_t i = 0; i + 2 < nodes.size(); i += 3)
      points.push_back({nodes[i], nodes[i + 1], nodes[i + 2] + (nodes[i] > 155 ? apart : 0)});
  }
  return points;
}

}  // namespace

TEST_CASE("a part that leaves the space of the simulations is logged for the component that it is of") {
  Bench bench;
  const std::string clamped = bench.file("clamped.lbea"), free = bench.file("free.lbea");
  bake_part_of_plates(clamped, {0, -INFINITY, 80});
  bake_part_of_plates(free, {0, 120, INFINITY});
  {
    const auto server = bench.start({LBEA_SERVE, clamped, free, "--frames", bench.frames(), "--results",
                                     bench.results(), "--method", "lbea", "--record", bench.file("run.mcap")},
                                    "serve", "ready: frames on " + bench.frames());
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 4; ++id) {
      const float apart = id < 3 ? 0 : 1000;
      camera.send_bytes(camera.encoder().frame(
          {id, static_cast<std::int64_t>(1'000'000 * id), plate_torn_by(apart, clamped, free)}, 1));
    }
    camera.end(4);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    CHECK(stop(*server) == 0);
  }
  const std::string log = text_of(bench.file("serve.err")), sentence = "more points than in the first frame";
  CAPTURE(log);
  CHECK(contains(log, "frame 3: free: " + sentence));
  CHECK_FALSE(contains(log, "clamped: " + sentence));
  CHECK_FALSE(contains(log, "frame 2: free: " + sentence));
  const Outcome replayed = bench.replay("run.mcap --model " + clamped + " --model " + free);
  CHECK(contains(replayed.err, "free: " + sentence));
  CHECK_FALSE(contains(replayed.err, "clamped: " + sentence));
}
