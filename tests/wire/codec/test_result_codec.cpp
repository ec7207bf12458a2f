#include "adapters/wire/codec/codec.hpp"

#include "result_generated.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

using namespace lbea;
using namespace lbea::wire;

namespace {

template <class Numbers>
bool have_equal_bits(const Numbers& a, const Numbers& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

WireResult some_result() {
  WireResult result;
  result.sequence = 11;
  result.session = 12;
  result.frame_id = 13;
  result.stamp_ns = -14;
  result.status = WireStatus::low_coverage;
  result.verdict = WireVerdict::low_coverage;
  result.reference = 15;
  float different = 0.25f;
  for (const auto& number : frame_numbers) result.*number.value = different++;
  result.points = {100, 1, 20, 79};
  result.matches = {{{3, 4}, "run_003", 0.0125, 1.5f}, {{0, 7}, "", -1, 2.5f}, {{5, 6}, "run_003", 0, 3.5f}};
  result.leading_coordinates = {1.5f, -2.5f, 3.5f};
  for (const auto& number : fit_numbers) result.fit.*number.value = different++;
  result.fit.candidates = {{{1, 2}, 1}, {{3, 4}, 1.5f}};
  result.fit.ranks = {2, 1};
  result.fit.estimate = {{{1, 2}, 0.25f}, {{3, 4}, 0.75f}};
  result.test = {9, 3, {1, 2}, 0.5f, {{3, 0.75f}, {1, 0.25f}}, {0.875f, 0.125f}, 1.25f, WireVerdict::ambiguous};
  result.forecast = {7, 2.5f, {{0, 1.25f}, {3, -0.25f}}, {0.25f, 0.75f}, {{8.5f, 0.5f, 0.875f}, {-1, 2, 0}}};
  result.channels = {{{12.5f, 0.5f}, "free end x", "mm", {125, 4}}, {{-3, std::nanf("")}, "", ""}};
  for (const char* name : {"left", ""}) {
    WireRigFrame& frame = result.rigs.emplace_back();
    for (const auto& number : frame_numbers) frame.*number.value = different++;
    for (const auto& number : fit_numbers) frame.*number.value = different++;
    frame.rig = name;
    frame.session = 31 + result.rigs.size();
    frame.frame_id = 41 + result.rigs.size();
    frame.stamp_ns = -51;
    frame.status = WireStatus::empty_frame;
    frame.verdict = WireVerdict::no_simulation_fits;
    frame.points = {61, 1, 20, 40};
    frame.is_used = result.rigs.size() == 1;
    frame.clock_correction_ns = 71 - 200 * static_cast<std::int64_t>(result.rigs.size());
  }
  result.elapsed_ns = {1, 2, {3, 4, 5, 6, 7, 9}, 8};
  result.counters.received = 1000;
  for (std::size_t i = 0; i < wire_status_count; ++i) result.counters.by_status[i] = 100 + i;
  result.counters.missed = 16;
  result.counters.duplicates = 17;
  result.counters.sessions = 18;
  result.counters.unannounced = 19;
  result.counters.interleaved = 22;
  result.counters.recorded = 20;
  result.counters.unrecorded = 21;
  result.receive_ns = 20;
  result.publish_ns = 21;
  result.model_checksum = 0xffff'ffff'ffff'fff0;
  result.component = "fender";
  result.points_near_none = 7;
  return result;
}

void check_equal(const WireResult& a, const WireResult& b) {
  CHECK(a.sequence == b.sequence);
  CHECK(a.session == b.session);
  CHECK(a.frame_id == b.frame_id);
  CHECK(a.stamp_ns == b.stamp_ns);
  CHECK(a.status == b.status);
  CHECK(a.verdict == b.verdict);
  CHECK(a.reference == b.reference);
  CHECK(have_equal_bits<FrameNumbers>(a, b));
  CHECK(std::memcmp(&a.points, &b.points, sizeof a.points) == 0);
  CHECK(std::memcmp(&a.elapsed_ns, &b.elapsed_ns, sizeof a.elapsed_ns) == 0);
  CHECK(a.counters == b.counters);
  CHECK(a.receive_ns == b.receive_ns);
  CHECK(a.publish_ns == b.publish_ns);
  CHECK(a.model_checksum == b.model_checksum);
  CHECK(a.component == b.component);
  CHECK(a.points_near_none == b.points_near_none);
  CHECK(a.leading_coordinates == b.leading_coordinates);
  CHECK(have_equal_bits<FitNumbers>(a.fit, b.fit));
  CHECK(a.fit.ranks == b.fit.ranks);
  CHECK(std::ranges::equal(a.fit.candidates, b.fit.candidates, [](const Match& p, const Match& q) {
    return p.sample == q.sample && p.distance == q.distance;
  }));
  CHECK(std::ranges::equal(a.fit.estimate, b.fit.estimate, [](const WeightedSample& p, const WeightedSample& q) {
    return p.sample == q.sample && p.weight == q.weight;
  }));
  CHECK(a.test.frames == b.test.frames);
  CHECK(a.test.simulation == b.test.simulation);
  CHECK(a.test.sample == b.test.sample);
  CHECK(a.test.sample_probability == b.test.sample_probability);
  CHECK(std::ranges::equal(a.test.simulations, b.test.simulations,
                           [](const SimulationChance& p, const SimulationChance& q) {
                             return p.simulation == q.simulation && p.probability == q.probability;
                           }));
  CHECK(a.test.branches == b.test.branches);
  CHECK(a.test.misfit == b.test.misfit);
  CHECK(a.test.verdict == b.test.verdict);
  CHECK(a.forecast.frames == b.forecast.frames);
  CHECK(a.forecast.error_90 == b.forecast.error_90);
  CHECK(std::ranges::equal(a.forecast.runs, b.forecast.runs, [](const RunWeight& p, const RunWeight& q) {
    return p.simulation == q.simulation && p.weight == q.weight;
  }));
  CHECK(a.forecast.branches == b.forecast.branches);
  CHECK(std::ranges::equal(a.forecast.parameters, b.forecast.parameters,
                           [](const ParameterForecast& p, const ParameterForecast& q) {
                             return p.value == q.value && p.bound_90 == q.bound_90 && p.r2 == q.r2;
                           }));
  CHECK(std::ranges::equal(a.channels, b.channels, [](const WireChannel& p, const WireChannel& q) {
    return have_equal_bits<ChannelValue>(p, q) && have_equal_bits<ChannelValue>(p.end, q.end) && p.name == q.name &&
           p.unit == q.unit;
  }));
  CHECK(std::ranges::equal(a.rigs, b.rigs, [](const WireRigFrame& p, const WireRigFrame& q) {
    const auto others = [](const WireRigFrame& f) {
      return std::tie(f.rig, f.session, f.frame_id, f.stamp_ns, f.status, f.verdict, f.is_used, f.clock_correction_ns);
    };
    return have_equal_bits<FitNumbers>(p, q) && have_equal_bits<FrameNumbers>(p, q) && others(p) == others(q) &&
           std::memcmp(&p.points, &q.points, sizeof p.points) == 0;
  }));
  REQUIRE(a.matches.size() == b.matches.size());
  for (std::size_t i = 0; i < a.matches.size(); ++i) {
    CHECK(a.matches[i].sample == b.matches[i].sample);
    CHECK(a.matches[i].simulation_name == b.matches[i].simulation_name);
    CHECK(a.matches[i].time_s == b.matches[i].time_s);
    CHECK(a.matches[i].distance == b.matches[i].distance);
  }
}

}  // namespace

// Regression: 0 was omitted, which other readers take for the schema's default, NaN.
TEST_CASE("a number that is 0 is in the message, and an absent one has the schema's default") {
  WireResult result = some_result();
  for (const auto& number : fit_numbers) result.fit.*number.value = 0;
  Encoder encoder;
  const schema::Fit* fit = schema::GetResult(encoder.result(result).data())->fit();
  CHECK(fit->pose_turn() == 0);
  CHECK(fit->error_90() == 0);
  WireResult read;
  REQUIRE(decode_result(encoder.result(result), read) == WireStatus::ok);
  CHECK(have_equal_bits<FitNumbers>(result.fit, read.fit));

  flatbuffers::FlatBufferBuilder older;  // a recording from before these numbers
  const std::vector<schema::Candidate> candidates{{1, 2, 0.5f}};
  const auto vector = older.CreateVectorOfStructs(candidates);
  schema::FitBuilder part(older);
  part.add_candidates(vector);
  const auto finished = part.Finish();
  schema::ResultBuilder whole(older);
  whole.add_fit(finished);
  schema::FinishResultBuffer(older, whole.Finish());
  REQUIRE(decode_result(std::as_bytes(std::span(older.GetBufferPointer(), older.GetSize())), read) == WireStatus::ok);
  CHECK(std::isnan(read.fit.pose_turn));
  CHECK(std::isnan(read.fit.test_time_sd));
  CHECK(read.fit.residual == 0);
  CHECK(read.coverage == 0);
}

TEST_CASE("a result is decoded unchanged, from any address") {
  Encoder encoder;
  for (const WireResult& result : {WireResult{}, some_result()}) {
    const auto message = encoder.result(result);
    CHECK(message_kind(message) == MessageKind::result);
    std::vector<std::uint64_t> aligned(message.size() / 8 + 4);
    auto* base = reinterpret_cast<std::byte*>(aligned.data());
    for (std::size_t shift = 0; shift < 16; ++shift) {
      std::memcpy(base + shift, message.data(), message.size());
      WireResult read = some_result();
      REQUIRE(decode_result({base + shift, message.size()}, read) == WireStatus::ok);
      check_equal(read, result);
    }
  }
}

TEST_CASE("the schema has every number of a result") {
  const auto has = [](const flatbuffers::TypeTable* table, std::string_view name) {
    const std::span names(table->names, table->num_elems);
    const auto found = std::ranges::find(names, name);
    return found != names.end() && table->type_codes[found - names.begin()].base_type == flatbuffers::ET_FLOAT;
  };
  for (const auto& number : frame_numbers) CHECK_MESSAGE(has(schema::ResultTypeTable(), number.name), number.name);
  for (const auto& number : fit_numbers) CHECK_MESSAGE(has(schema::FitTypeTable(), number.name), number.name);
  for (const auto& number : frame_numbers) CHECK_MESSAGE(has(schema::RigFrameTypeTable(), number.name), number.name);
  for (const auto& number : fit_numbers) CHECK_MESSAGE(has(schema::RigFrameTypeTable(), number.name), number.name);
}

TEST_CASE("a result may have a thousand matches") {
  WireResult result;
  for (std::uint32_t i = 0; i < 1000; ++i) result.matches.push_back({{i, i}, "run_" + std::to_string(i), 0, 0});
  Encoder encoder;
  WireResult read;
  REQUIRE(decode_result(encoder.result(result), read) == WireStatus::ok);
  check_equal(read, result);
}

TEST_CASE("a state is decoded unchanged") {
  const ModelSummary model{"rail.lbea", 7, 8, 9, 10, 11, "mm", {"run_001", "", "run_003"}};
  const std::vector<WireSender> senders{{1, 2, 30, 20, 5, 3, SenderCondition::silent, "left"}, {}};
  const WireState state{1,
                        2,
                        3,
                        "0.1.0",
                        "lbea",
                        4,
                        5,
                        6,
                        some_result().counters,
                        model,
                        1 << 20,
                        senders,
                        WireRecording{RecordingPhase::armed, 1ull << 40, 1ull << 50}};
  Encoder encoder;
  const auto message = encoder.state(state);
  CHECK(message_kind(message) == MessageKind::state);
  WireState read;
  REQUIRE(decode_state(message, read) == WireStatus::ok);
  CHECK(read.sequence == 1);
  CHECK(read.publish_ns == 2);
  CHECK(read.start_ns == 3);
  CHECK(read.version == "0.1.0");
  CHECK(read.method == "lbea");
  CHECK(read.max_points == 4);
  CHECK(read.queue_slots == 5);
  CHECK(read.queue_used == 6);
  CHECK(read.counters == state.counters);
  CHECK(read.model.file == "rail.lbea");
  CHECK(read.model.checksum == 7);
  CHECK(read.model.vertices == 8);
  CHECK(read.model.modes == 9);
  CHECK(read.model.samples == 10);
  CHECK(read.model.references == 11);
  CHECK(read.model.length_unit == "mm");
  CHECK(read.model.simulations == state.model.simulations);
  CHECK(read.max_message_bytes == 1 << 20);
  CHECK(read.senders == senders);
  CHECK(read.recording == state.recording);
  REQUIRE(decode_state(encoder.state({}), read) == WireStatus::ok);
  CHECK_FALSE(read.recording.has_value());
}

TEST_CASE("a control message is decoded unchanged, from any address, and never partially") {
  Encoder encoder;
  constexpr auto most = std::numeric_limits<std::uint64_t>::max();
  for (const Control& control :
       {Control{}, Control{7, ControlKind::hello, 0, 0}, Control{most, ControlKind::goodbye, most, most},
        Control{1, ControlKind::heartbeat, 10, 10}}) {
    const auto message = encoder.control(control);
    CHECK(message_kind(message) == MessageKind::control);
    std::vector<std::byte> bytes(message.size() + 16);
    Control read;
    for (std::size_t shift = 0; shift < 16; ++shift) {
      std::copy(message.begin(), message.end(), bytes.begin() + static_cast<std::ptrdiff_t>(shift));
      REQUIRE(decode_control(std::span(bytes).subspan(shift, message.size()), read) == WireStatus::ok);
      CHECK(read == control);
    }
    for (std::size_t length = 8; length < message.size(); ++length)
      CHECK(decode_control(message.first(length), read) == WireStatus::damaged);
    CHECK(decode_control({}, read) == WireStatus::wrong_kind);
    CHECK(FrameDecoder().open(message) == WireStatus::wrong_kind);
  }
  Control read;
  CHECK(decode_control(encoder.control({1, ControlKind::heartbeat, 10, 11}), read) == WireStatus::damaged);
  CHECK(decode_control(encoder.control({1, static_cast<ControlKind>(3), 10, 1}), read) == WireStatus::damaged);
  CHECK(decode_control(std::vector<std::byte>(257), read) == WireStatus::message_too_large);
  CHECK(decode_control(encoder.end_of_stream(1, 1), read) == WireStatus::wrong_kind);
}

TEST_CASE("an inference is decoded unchanged, with any number of values, and never partially") {
  Encoder encoder;
  for (const std::size_t count : {0u, 1u, 2u, 5'000u}) {
    WireInference sent{1, 2, 3, -4, "plastic_strain", "1", FieldInfo::Location::node, {}, {}, 5};
    for (std::size_t i = 0; i < count; ++i)
      sent.values.push_back(static_cast<float>(i) * 0.5f), sent.spread.push_back(static_cast<float>(i) * 0.25f);
    if (count > 1) sent.bound_90.assign(count, 0.5f);
    const auto message = encoder.inference(sent);
    CHECK(message_kind(message) == MessageKind::inference);
    WireInference read;
    REQUIRE(decode_inference(message, read) == WireStatus::ok);
    CHECK(std::tuple(read.sequence, read.session, read.frame_id, read.stamp_ns, read.model_checksum) ==
          std::tuple(1u, 2u, 3u, -4, 5u));
    CHECK(std::tuple(read.field, read.unit, read.location) ==
          std::tuple("plastic_strain", "1", FieldInfo::Location::node));
    CHECK(read.values == sent.values);
    CHECK(read.spread == sent.spread);
    CHECK(read.bound_90 == sent.bound_90);
    const std::vector<std::byte> whole(message.begin(), message.end());
    for (std::size_t length = 8; length < whole.size(); length += 1 + whole.size() / 200)
      if (decode_inference(std::span(whole).first(length), read) ==
          WireStatus::ok)  // only the padding at the end may go
        CHECK((read.values == sent.values && read.field == sent.field && length + 8 > whole.size()));
  }
  WireInference read;
  CHECK(decode_inference(encoder.inference({.values = {1, 2}, .spread = {1}}), read) == WireStatus::damaged);
  CHECK(decode_inference(encoder.inference({.values = {1, 2}, .spread = {1, 1}, .bound_90 = {1}}), read) ==
        WireStatus::damaged);
  CHECK(decode_inference(encoder.result({}), read) == WireStatus::wrong_kind);
}

TEST_CASE("results and states are distinguished, truncated ones rejected") {
  Encoder encoder;
  WireResult result;
  WireState state;
  CHECK(decode_result(encoder.state({}), result) == WireStatus::wrong_kind);
  CHECK(decode_state(encoder.result({}), state) == WireStatus::wrong_kind);
  CHECK(decode_result({}, result) == WireStatus::wrong_kind);
  CHECK(message_kind({}) == MessageKind::unknown);
  const auto message = encoder.result(some_result());
  for (std::size_t length = 8; length < message.size(); ++length) {
    const std::vector<std::byte> cut(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(length));
    CAPTURE(length);
    CHECK(decode_result(cut, result) == WireStatus::damaged);
  }
}

TEST_CASE("every status has a name, a sentence and a fate") {
  Counters counters;
  for (std::size_t i = 0; i < wire_status_count; ++i) {
    const auto status = static_cast<WireStatus>(i);
    CHECK(to_string(status) != "unknown_status");
    CHECK(explain(status).size() > 5);
    for (std::size_t j = 0; j < i; ++j) CHECK(to_string(status) != to_string(static_cast<WireStatus>(j)));
    counters.by_status[i] = std::uint64_t{1} << i;
  }
  CHECK(to_string(static_cast<WireStatus>(wire_status_count)) == "unknown_status");
  CHECK(counters.sum(Fate::matched) == 0b11);
  CHECK(counters.sum(Fate::rejected) == 0b1'0000'1111'1111'1100);
  CHECK(counters.sum(Fate::dropped) == 0b110'1101'0000'0000'0000);
  // missed and withheld are not received
  counters.received = 0b111'0001'1111'1111'1111;
  CHECK(counters.adds_up());
  ++counters.received;
  CHECK_FALSE(counters.adds_up());
}
