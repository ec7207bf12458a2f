// Fields in 16 bits: the stated error is a bound, minimum and maximum are exact, and rounding twice equals rounding
// once.
#include "runtime/src/model/field_codes.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/precompute/jobs/shard_plates.hpp"
#include "tests/support/refusals.hpp"

#include <lbea/inference.hpp>

#include <cfloat>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

struct Rounded {
  FieldRange range;
  std::vector<FieldCode> codes;
  std::vector<float> values;
};

Rounded rounded(const std::vector<float>& values) {
  Rounded result{range_of_field(values), {}, std::vector<float>(values.size())};
  for (const float value : values) result.codes.push_back(encoded(value, result.range));
  decode(result.codes, result.range, result.values);
  return result;
}

/// Returns how far the worst value is off.
double check_bound(const std::vector<float>& values) {
  double worst = 0;
  const Rounded once = rounded(values);
  const double bound = double{largest_error(once.range)};
  // Half a step, and no more than one more rounding to single precision.
  const double greatest = std::max(std::abs(double{once.range.low}), std::abs(double{once.range.high}));
  CHECK(bound <= once.range.step() / 2 + greatest * double{FLT_EPSILON} + 2 * double{FLT_TRUE_MIN});
  for (std::size_t i = 0; i < values.size(); ++i) {
    CAPTURE(values[i]);
    if (std::isnan(values[i])) {
      REQUIRE(std::isnan(once.values[i]));
      continue;
    }
    const bool is_exact = std::isinf(values[i]) || values[i] == once.range.low || values[i] == once.range.high;
    if (is_exact)
      REQUIRE(once.values[i] == values[i]);
    else
      worst = std::max(worst, std::abs(double{once.values[i]} - double{values[i]}));
  }
  CHECK(worst <= bound);
  const Rounded twice = rounded(once.values);
  CHECK(twice.range.low == once.range.low);
  CHECK(twice.range.high == once.range.high);
  CHECK(twice.codes == once.codes);
  return worst;
}

EnsembleDescription compact() {
  EnsembleDescription description = shard_description();
  description.compact_fields = true;
  return description;
}

}  // namespace

TEST_CASE("no rounding error exceeds the stated one, for any range") {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int exponent = -148; exponent <= 127; exponent += 5)
    for (const float offset : {0.0f, 1.0f, -3e4f, 1e20f}) {
      CAPTURE(exponent);
      CAPTURE(offset);
      std::vector<float> values;
      for (int i = 0; i < 200; ++i) values.push_back(offset + std::ldexp(uniform(random) - 0.3f, exponent));
      const double worst = check_bound(values);
      const bool is_tight = offset != 0 || exponent < -100 || worst > double{largest_error(range_of_field(values))} / 2;
      CHECK(is_tight);  // of 200 values one is off by more than half of the bound, but for a chance of 2^-200
    }
  // Neighbours in single precision, where a step is about as long as the spacing of numbers: each count of them once.
  for (const int count : {1, 2, 65'531, 65'532, 65'533, 131'064, 200'000}) {
    std::vector<float> values{8'388'000.0f};
    for (int i = 0; i < count; ++i) values.push_back(std::nextafter(values.back(), infinity));
    check_bound(values);
    for (float& value : values) value = -value;
    check_bound(values);
  }
  check_bound({-FLT_MAX, FLT_MAX, 0, 1, -1, FLT_MIN, FLT_TRUE_MIN});
  check_bound({FLT_TRUE_MIN, 0, 2 * FLT_TRUE_MIN});
  check_bound({-1e38f, 1e-38f});
}

TEST_CASE("constant fields are exact; NaN and infinities are restored") {
  for (const float value : {0.0f, 17.25f, -FLT_MAX, FLT_TRUE_MIN}) {
    const Rounded same = rounded({value, value, value});
    CHECK(same.values == std::vector<float>{value, value, value});
    CHECK(largest_error(same.range) == 0);
  }
  check_bound({});
  check_bound({not_a_number, infinity, -infinity});
  check_bound({not_a_number, 3, infinity, 4, -infinity, 5});
  CHECK(largest_error(range_of_field(std::vector{not_a_number, infinity})) == 0);
}

TEST_CASE("a model in 16 bits reproduces the runs' fields within the stated error, through every reading function") {
  for (const std::uint32_t steps : {1u, 3u, 40u}) {
    const CountedPlates plates = counted_plates(3, steps);
    const TemporaryFolder folder;
    const BakeSummary summary = bake_model(plates.ensemble, compact(), folder / "compact.lbea", shard_options());
    bake_model(plates.ensemble, shard_description(), folder / "whole.lbea", shard_options());
    const Model small = Model::open(folder / "compact.lbea"), whole = Model::open(folder / "whole.lbea");
    REQUIRE(summary.rounded_fields.size() == 1);
    CHECK(summary.rounded_fields[0].largest_error == small.field(0).largest_error);
    CHECK(small.field(0).largest_error > 0);
    CHECK(small.field(0).largest_error < 1e-4f);
    CHECK(whole.field(0).largest_error == 0);
    CHECK(contains(std::string(small.provenance()), "\"compact_fields\":true"));
    CHECK_FALSE(contains(std::string(whole.provenance()), "compact"));
    std::vector<float> read(small.field_size(0)), exact(whole.field_size(0));
    float worst = 0;
    for (std::uint32_t s = 0; s < small.samples(); ++s) {
      CHECK(small.field_values(0, s).empty());
      small.read_field(0, s, read);
      whole.read_field(0, s, exact);
      CHECK(std::ranges::equal(exact, whole.field_values(0, s)));
      for (std::size_t e = 0; e < read.size(); ++e) worst = std::max(worst, std::abs(read[e] - exact[e]));
    }
    CHECK(worst <= small.field(0).largest_error);
    Inferred mean, mean_whole;
    const std::vector<WeightedSample> estimate{{small.sample(0), 0.25f}, {small.sample(small.samples() - 1), 0.75f}};
    infer_field(small, 0, estimate, estimate, mean);
    infer_field(whole, 0, estimate, estimate, mean_whole);
    for (std::size_t e = 0; e < read.size(); ++e)  // a convex combination keeps the bound; rounding adds an epsilon
      CHECK(std::abs(mean.mean[e] - mean_whole.mean[e]) <=
            small.field(0).largest_error + 2 * FLT_EPSILON * std::abs(mean_whole.mean[e]));
  }
}

TEST_CASE("the merge decides between 16 and 32 bits: the same records serve both") {
  const CountedPlates plates = counted_plates(4);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan whole = plan_bake(work, plates.ensemble, shard_description(), shard_options());
  for (const std::uint32_t index : {2u, 0u, 1u}) bake_shard(work, whole, {index, 3}, shard_options());
  CHECK(merged(work, whole) == baked_alone(plates.ensemble, shard_description()));
  const BakePlan small = plan_bake(work, plates.ensemble, compact(), shard_options());
  CHECK(bake_shard(work, small, {}, shard_options()).finished == 4);
  CHECK(merged(work, small) == baked_alone(plates.ensemble, compact()));
}
