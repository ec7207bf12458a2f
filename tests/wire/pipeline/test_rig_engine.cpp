// The matcher of several rigs with its test, as lbea-serve and lbea-replay use it.
#include "tests/runtime/rigs/two_rigs.hpp"
#include "tools/shared/matching/match_engine.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;

// Regression: the frames of two tests gave "matched" with 100 %.
TEST_CASE("a test in which the rigs see different shapes has no verdict until another one begins") {
  const TwoRigs two;
  tool::ModelRigEngine engine(two.model, fit_config(), two.rigs, {});
  int capture = 0;
  const auto verdicts = [&](double above_angle, double below_angle) {
    const auto above = seen_from(two.sensors[0], bent(above_angle)),
               below = seen_from(two.sensors[1], bent(below_angle), 2);
    engine.match_alone(0, at(capture, above));
    engine.match_alone(1, at(capture++, below));
    const MatchResult result = engine.combine();
    for (const RigResult& rig : engine.rigs()) CHECK((rig.is_used && rig.verdict == Verdict::matched));
    return std::pair(result.verdict, engine.track(result)->verdict);
  };
  for (const double angle : {0.3, 0.33, 0.36, 0.39, 0.42, 0.45})
    CHECK(verdicts(angle, angle).first == Verdict::matched);
  CHECK(verdicts(0.48, 0.48).second == Verdict::matched);
  for (int i = 0; i < 4; ++i) CHECK(verdicts(0.48, 0.53).first == Verdict::unknown);
  CHECK(verdicts(0.48, 0.53).second == Verdict::unknown);
  engine.begin_test();
  for (const double angle : {0.3, 0.33, 0.36, 0.39}) static_cast<void>(verdicts(angle, angle));
  CHECK(verdicts(0.42, 0.42).second == Verdict::matched);
}
