#include "tools/sense/schedule.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;

namespace {

const std::vector<double> times{0, 0.5, 1.0, 2.0};
constexpr std::uint64_t no_limit = 1000;

std::vector<double> states_of(const std::vector<FrameTime>& frames) {
  std::vector<double> states;
  for (const FrameTime& frame : frames) states.push_back(frame.state);
  return states;
}

/// Node 0 moves along x by 10 per state, element 0 erodes in state 2.
class MovingRun : public SimulationReader {
 public:
  std::uint32_t reads = 0;

  [[nodiscard]] const SimulationMesh& mesh() const noexcept override { return mesh_; }
  [[nodiscard]] const std::vector<SimulationField>& fields() const noexcept override { return fields_; }
  [[nodiscard]] std::uint32_t states() const noexcept override { return 4; }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return times[state]; }
  void read(std::uint32_t state, SimulationState& into) override {
    ++reads;
    into.time_s = times[state];
    into.positions = {10 * static_cast<float>(state), 1, 2};
    into.alive = {state < 2 ? std::uint8_t{1} : std::uint8_t{0}};
  }
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return {}; }

 private:
  SimulationMesh mesh_;
  std::vector<SimulationField> fields_;
};

}  // namespace

TEST_CASE("steps: all, one, a range, a range with a stride, and nothing else") {
  CHECK(states_of(stored_frames(times, parse_steps("all").value())) == std::vector<double>{0, 1, 2, 3});
  CHECK(states_of(stored_frames(times, parse_steps("2").value())) == std::vector<double>{2});
  CHECK(states_of(stored_frames(times, parse_steps("1:3").value())) == std::vector<double>{1, 2, 3});
  CHECK(states_of(stored_frames(times, parse_steps("1:3:2").value())) == std::vector<double>{1, 3});
  CHECK(states_of(stored_frames(times, parse_steps("0:3:2").value())) == std::vector<double>{0, 2});
  for (const std::string bad :
       {"", "x", "-1", "1:", ":3", "3:1", "0:3:0", "0:3:1:1", "1 ", "1.5", "0:3:", "99999999999"})
    CHECK_FALSE(parse_steps(bad).has_value());
}

TEST_CASE("steps beyond the run, and a run without states, are refused") {
  CHECK_THROWS_AS((void)stored_frames(times, parse_steps("2:4").value()), Error);
  CHECK_THROWS_AS((void)stored_frames({}, parse_steps("all").value()), Error);
  CHECK_THROWS_AS((void)resampled_frames({}, parse_steps("all").value(), 1, no_limit), Error);
}

TEST_CASE("a rate gives frames at equal time steps, independent of the states' times") {
  const auto frames = resampled_frames(times, StepRange{}, 4, no_limit);
  REQUIRE(frames.size() == 9);  // 0, 0.25, ... 2
  for (std::size_t i = 0; i < frames.size(); ++i)
    CHECK(frames[i].time_s == doctest::Approx(0.25 * static_cast<double>(i)));
  CHECK(states_of(frames) == std::vector<double>{0, 0.5, 1, 1.5, 2, 2.25, 2.5, 2.75, 3});
  const auto middle = resampled_frames(times, parse_steps("1:2").value(), 4, no_limit);
  CHECK(states_of(middle) == std::vector<double>{1, 1.5, 2});
  CHECK(resampled_frames(times, StepRange{}, 4, 3).size() == 3);
  CHECK(resampled_frames(times, StepRange{}, 0.1, no_limit).size() == 1);
  CHECK(resampled_frames({0.7}, StepRange{}, 1000, no_limit).size() == 1);
  CHECK(resampled_frames(times, StepRange{}, 1e12, 5).size() == 5);
  CHECK_THROWS_AS((void)resampled_frames(times, StepRange{}, 1e12, std::uint64_t{1} << 40), Error);
}

TEST_CASE("between stored states positions are linear in time, and elements that erode later still exist") {
  MovingRun run;
  StateSource source(run);
  CHECK(source.at(1).positions[0] == 10);
  CHECK(source.at(1.25).positions[0] == doctest::Approx(12.5));
  CHECK(source.at(1.25).time_s == doctest::Approx(0.625));
  CHECK(source.at(1.25).alive[0] == 1);
  CHECK(source.at(1.75).positions[0] == doctest::Approx(17.5));
  CHECK(source.at(2).alive[0] == 0);
  CHECK(source.at(3).positions[0] == 30);  // the last state needs none after it
  CHECK(run.reads == 3);                   // each state once
}
