// Messages of other writers that omit fields: read with the defaults, without null access.
#include "adapters/wire/codec/codec.hpp"

#include "inference_generated.h"
#include "result_generated.h"
#include "state_generated.h"

#include <doctest/doctest.h>

#include <flatbuffers/flatbuffers.h>

#include <vector>

using namespace lbea;
using namespace lbea::wire;

namespace {

std::span<const std::byte> bytes_of(const flatbuffers::FlatBufferBuilder& builder) {
  return std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize()));
}

}  // namespace

TEST_CASE("an empty result, and one with empty parts") {
  flatbuffers::FlatBufferBuilder empty;
  schema::FinishResultBuffer(empty, schema::CreateResult(empty));
  WireResult result;
  REQUIRE(decode_result(bytes_of(empty), result) == WireStatus::ok);
  CHECK(result.matches.empty());
  CHECK(result.counters == Counters{});
  CHECK(result.fit.candidates.empty());

  flatbuffers::FlatBufferBuilder hollow;
  const auto counters = schema::CreateCounters(hollow);
  const auto fit = schema::CreateFit(hollow);
  const auto test = schema::CreateTestState(hollow);
  const auto forecast = schema::CreateForecast(hollow);
  schema::ResultBuilder builder(hollow);
  builder.add_counters(counters);
  builder.add_fit(fit);
  builder.add_test(test);
  builder.add_forecast(forecast);
  schema::FinishResultBuffer(hollow, builder.Finish());
  REQUIRE(decode_result(bytes_of(hollow), result) == WireStatus::ok);
  CHECK(result.counters == Counters{});
  CHECK(result.fit.candidates.empty());
  CHECK(result.fit.estimate.empty());
  CHECK(result.test.simulations.empty());
  CHECK(result.test.branches.empty());
  CHECK(result.forecast.runs.empty());
  CHECK(result.forecast.parameters.empty());
}

TEST_CASE("an empty state and inference; oversized messages") {
  flatbuffers::FlatBufferBuilder empty;
  schema::FinishStateBuffer(empty, schema::CreateState(empty));
  WireState state;
  REQUIRE(decode_state(bytes_of(empty), state) == WireStatus::ok);
  CHECK(state.version.empty());
  CHECK(state.senders.empty());
  CHECK(state.model.simulations.empty());

  empty.Clear();
  const auto model = schema::CreateModelSummary(empty);
  schema::StateBuilder with_model(empty);
  with_model.add_model(model);
  schema::FinishStateBuffer(empty, with_model.Finish());
  REQUIRE(decode_state(bytes_of(empty), state) == WireStatus::ok);
  CHECK(state.model.simulations.empty());

  empty.Clear();
  schema::FinishInferenceBuffer(empty, schema::CreateInference(empty));
  WireInference inference;
  REQUIRE(decode_inference(bytes_of(empty), inference) == WireStatus::ok);
  CHECK(inference.values.empty());

  empty.Clear();
  schema::InferenceBuilder elsewhere(empty);
  elsewhere.add_location(static_cast<schema::FieldLocation>(9));
  schema::FinishInferenceBuffer(empty, elsewhere.Finish());
  CHECK(decode_inference(bytes_of(empty), inference) == WireStatus::damaged);

  const std::vector<std::byte> huge(65u << 20);
  CHECK(decode_inference(huge, inference) == WireStatus::message_too_large);
  WireResult result;
  CHECK(decode_result(huge, result) == WireStatus::message_too_large);
  CHECK(decode_state(huge, state) == WireStatus::message_too_large);
}
