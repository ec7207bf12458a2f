// The check of method fit: right answers pass, wrong depth images and candidates do not.
#include "tests/bench/plates.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tools/bench/fit/fit_answer.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::test;
using namespace lbea::tool::bench;

TEST_CASE("the product and the plain loops pass the check of method fit; changed answers do not") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  const MatcherConfig config = fit_config();
  const std::vector<Point> points = seen(bent(0.75), {.sigma = 0.1f});
  const Frame frame{.points = points};
  FrameCheck check(task_of(model, config), points);
  const auto verdict = [&](const Answer& answer) { return check.disagreement(answer).value_or("right"); };
  const auto product = fit_pipeline(model, config), plain = plain_fit_pipeline(model, config);
  const Answer answer = product->answer(frame);
  REQUIRE(answer.fit.has_value());
  REQUIRE_FALSE(answer.fit->is_hidden);
  CHECK(verdict(answer) == "right");
  CHECK(verdict(plain->answer(frame)) == "right");

  const auto wrong = [&](const auto& change) {
    Answer changed = answer;
    change(*changed.fit);
    return verdict(changed);
  };
  CHECK(wrong([](FitAnswer& fit) { fit.depth_image.pop_back(); }) != "right");
  CHECK(wrong([](FitAnswer& fit) { std::ranges::fill(fit.depth_image, nothing_seen); }) != "right");
  CHECK(wrong([](FitAnswer& fit) {
          for (float& depth : fit.depth_image) depth += 10;
        }) != "right");
  CHECK(wrong([](FitAnswer& fit) { fit.proposed.pop_back(); }) != "right");
  CHECK(wrong([](FitAnswer& fit) { fit.proposed.front().distance *= 1.5f; }) != "right");
  CHECK(wrong([](FitAnswer& fit) { fit.candidates.pop_back(); }) != "right");
  CHECK(wrong([](FitAnswer& fit) { std::swap(fit.candidates.front(), fit.candidates.back()); }) != "right");
  CHECK(wrong([](FitAnswer& fit) { fit.candidates[3].distance *= 1.01f; }) != "right");
}
