#include "adapters/wire/codec/codec.hpp"

#include "adapters/wire/codec/flatbuffer.hpp"
#include "result_generated.h"
#include "state_generated.h"

#include <flatbuffers/reflection_generated.h>

#include <algorithm>

namespace lbea::wire {
namespace {
using detail::text;
using flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

constexpr detail::MessageLimits result_limits{16 << 20, 65'536};

/// Where a number of a table is in a message, and its value when it is absent.
struct Slot {
  flatbuffers::voffset_t offset = 0;
  float absent = 0;
};

/// By the numbers' names in the schema.
template <class Numbers, std::size_t count>
std::array<Slot, count> slots_of(const std::array<NumberInfo<Numbers>, count>& numbers, const char* table) {
  const auto* fields = reflection::GetSchema(result_schema().data())->objects()->LookupByKey(table)->fields();
  std::array<Slot, count> slots;
  slots.fill({flatbuffers::FieldIndexToOffset(static_cast<flatbuffers::voffset_t>(fields->size()))});
  for (std::size_t i = 0; i < count; ++i)
    if (const reflection::Field* field = fields->LookupByKey(numbers[i].name))
      slots[i] = {field->offset(), static_cast<float>(field->default_real())};
  return slots;
}
const auto frame_slots = slots_of(frame_numbers, "lbea.wire.Result");
const auto fit_slots = slots_of(fit_numbers, "lbea.wire.Fit");
const auto rig_frame_slots = slots_of(frame_numbers, "lbea.wire.RigFrame");
const auto rig_fit_slots = slots_of(fit_numbers, "lbea.wire.RigFrame");

/// Adds the numbers to the table that is being built; also those with the value of absent ones.
template <class Numbers, std::size_t count>
void add(FlatBufferBuilder& builder, const Numbers& from, const std::array<NumberInfo<Numbers>, count>& numbers,
         const std::array<Slot, count>& slots) {
  for (std::size_t i = count; i-- > 0;) builder.AddElement<float>(slots[i].offset, from.*numbers[i].value);
}

template <class Table, class Numbers, std::size_t count>
void read(const Table* table, Numbers& into, const std::array<NumberInfo<Numbers>, count>& numbers,
          const std::array<Slot, count>& slots) {
  const auto* from = reinterpret_cast<const flatbuffers::Table*>(table);
  for (std::size_t i = 0; i < count; ++i)
    into.*numbers[i].value = from->GetField<float>(slots[i].offset, slots[i].absent);
}

Offset<schema::Counters> build(FlatBufferBuilder& builder, const Counters& counters) {
  const auto by_status = builder.CreateVector(counters.by_status.data(), counters.by_status.size());
  return schema::CreateCounters(builder, counters.received, counters.sum(Fate::matched), counters.sum(Fate::rejected),
                                counters.sum(Fate::dropped), by_status, counters.missed, counters.duplicates,
                                counters.sessions, counters.unannounced, counters.recorded, counters.unrecorded,
                                counters.reordered, counters.silent, counters.interleaved);
}

Counters read(const schema::Counters* from) {
  Counters counters;
  if (from == nullptr) return counters;
  counters.received = from->received();
  if (from->by_status() != nullptr) {
    const auto known = std::min<std::size_t>(from->by_status()->size(), wire_status_count);
    std::memcpy(counters.by_status.data(), from->by_status()->Data(), known * sizeof(std::uint64_t));
  }
  counters.missed = from->missed();
  counters.duplicates = from->duplicates();
  counters.sessions = from->sessions();
  counters.unannounced = from->unannounced();
  counters.recorded = from->recorded();
  counters.unrecorded = from->unrecorded();
  counters.reordered = from->reordered();
  counters.silent = from->silent();
  counters.interleaved = from->interleaved();
  return counters;
}

Offset<schema::Match> build(FlatBufferBuilder& builder, const WireMatch& match) {
  const auto name = builder.CreateSharedString(match.simulation_name);
  return schema::CreateMatch(builder, match.sample.simulation, name, match.sample.time_step, match.time_s,
                             match.distance);
}

WireMatch read(const schema::Match& from) {
  return {{from.simulation(), from.time_step()}, text(from.simulation_name()), from.time_s(), from.distance()};
}

schema::StageTimes build(const WireTimes& times) {
  const StageTimes& m = times.match;
  return {times.decode, times.queue, m.index, m.correspondence, m.projection,
          m.matching,   m.coverage,  m.fit,   times.total};
}

WireTimes read(const schema::StageTimes* from) {
  if (from == nullptr) return {};
  return {from->decode(),
          from->queue(),
          {from->index(), from->correspondence(), from->projection(), from->matching(), from->coverage(), from->fit()},
          from->total()};
}

schema::PointTally build(const PointTally& points) {
  return {points.received, points.invalid, points.culled, points.used};
}

PointTally read(const schema::PointTally* from) {
  if (from == nullptr) return {};
  return {from->received(), from->invalid(), from->culled(), from->used()};
}

Offset<schema::Fit> build(FlatBufferBuilder& builder, const WireFit& fit) {
  if (fit.candidates.empty()) return 0;
  std::vector<schema::Candidate> candidates;
  for (const Match& c : fit.candidates) candidates.emplace_back(c.sample.simulation, c.sample.time_step, c.distance);
  std::vector<schema::Share> estimate;
  for (const WeightedSample& s : fit.estimate) estimate.emplace_back(s.sample.simulation, s.sample.time_step, s.weight);
  const auto candidate_vector = builder.CreateVectorOfStructs(candidates);
  const auto share_vector = builder.CreateVectorOfStructs(estimate);
  const auto ranks = builder.CreateVector(fit.ranks);
  schema::FitBuilder table(builder);
  table.add_ranks(ranks);
  table.add_estimate(share_vector);
  table.add_candidates(candidate_vector);
  add<FitNumbers>(builder, fit, fit_numbers, fit_slots);
  return table.Finish();
}

WireFit read(const schema::Fit* from) {
  WireFit fit;
  if (from == nullptr) return fit;
  read<schema::Fit, FitNumbers>(from, fit, fit_numbers, fit_slots);
  if (from->candidates() != nullptr)
    for (const auto* c : *from->candidates())
      fit.candidates.push_back({{c->simulation(), c->time_step()}, c->residual()});
  if (from->ranks() != nullptr && from->ranks()->size() == fit.candidates.size())
    fit.ranks.assign(from->ranks()->begin(), from->ranks()->end());
  if (from->estimate() != nullptr)
    for (const auto* s : *from->estimate()) fit.estimate.push_back({{s->simulation(), s->time_step()}, s->weight()});
  return fit;
}

Offset<schema::TestState> build(FlatBufferBuilder& builder, const WireTestState& test) {
  if (test.frames == 0) return 0;
  std::vector<schema::Chance> chances;
  for (const SimulationChance& c : test.simulations) chances.emplace_back(c.simulation, c.probability);
  const auto chance_vector = builder.CreateVectorOfStructs(chances);
  const auto branches = builder.CreateVector(test.branches);
  return schema::CreateTestState(builder, test.frames, test.simulation, test.sample.simulation, test.sample.time_step,
                                 test.sample_probability, chance_vector, branches, test.misfit,
                                 static_cast<schema::Verdict>(test.verdict));
}

WireTestState read(const schema::TestState* from) {
  WireTestState test;
  if (from == nullptr) return test;
  test.frames = from->frames();
  test.simulation = from->simulation();
  test.sample = {from->sample_simulation(), from->sample_time_step()};
  test.sample_probability = from->sample_probability();
  test.misfit = from->misfit();
  test.verdict = static_cast<WireVerdict>(from->verdict());
  if (from->simulations() != nullptr)
    for (const auto* c : *from->simulations()) test.simulations.push_back({c->simulation(), c->probability()});
  if (from->branches() != nullptr) test.branches.assign(from->branches()->begin(), from->branches()->end());
  return test;
}

Offset<flatbuffers::Vector<Offset<schema::Channel>>> build(FlatBufferBuilder& builder,
                                                           const std::vector<WireChannel>& channels) {
  if (channels.empty()) return 0;
  std::vector<Offset<schema::Channel>> built;
  for (const WireChannel& channel : channels) {
    const auto name = builder.CreateString(channel.name), unit = builder.CreateString(channel.unit);
    built.push_back(schema::CreateChannel(builder, name, unit, channel.value, channel.bound_90, channel.end.value,
                                          channel.end.bound_90));
  }
  return builder.CreateVector(built);
}

std::vector<WireChannel> read(const flatbuffers::Vector<Offset<schema::Channel>>* from) {
  std::vector<WireChannel> channels;
  if (from == nullptr) return channels;
  for (const auto* c : *from)
    channels.push_back(
        {{c->value(), c->bound_90()}, text(c->name()), text(c->unit()), {c->end_value(), c->end_bound_90()}});
  return channels;
}

Offset<schema::RigFrame> build(FlatBufferBuilder& builder, const WireRigFrame& frame) {
  const auto rig = builder.CreateString(frame.rig);
  const schema::PointTally points = build(frame.points);
  schema::RigFrameBuilder table(builder);
  table.add_clock_correction_ns(frame.clock_correction_ns);
  table.add_stamp_ns(frame.stamp_ns);
  table.add_frame_id(frame.frame_id);
  table.add_session(frame.session);
  add<FitNumbers>(builder, frame, fit_numbers, rig_fit_slots);
  add<FrameNumbers>(builder, frame, frame_numbers, rig_frame_slots);
  table.add_points(&points);
  table.add_rig(rig);
  table.add_is_used(frame.is_used);
  table.add_verdict(static_cast<schema::Verdict>(frame.verdict));
  table.add_status(static_cast<schema::WireStatus>(frame.status));
  return table.Finish();
}

WireRigFrame read(const schema::RigFrame& from) {
  WireRigFrame frame;
  read<schema::RigFrame, FitNumbers>(&from, frame, fit_numbers, rig_fit_slots);
  read<schema::RigFrame, FrameNumbers>(&from, frame, frame_numbers, rig_frame_slots);
  frame.rig = text(from.rig());
  frame.session = from.session();
  frame.frame_id = from.frame_id();
  frame.stamp_ns = from.stamp_ns();
  frame.status = static_cast<WireStatus>(from.status());
  frame.verdict = static_cast<WireVerdict>(from.verdict());
  frame.points = read(from.points());
  frame.is_used = from.is_used();
  frame.clock_correction_ns = from.clock_correction_ns();
  return frame;
}

Offset<schema::Rig> build(FlatBufferBuilder& builder, const WireRig& rig) {
  const auto name = builder.CreateString(rig.name), endpoint = builder.CreateString(rig.endpoint);
  return schema::CreateRig(builder, name, endpoint, rig.clock_offset_ns, build(builder, rig.counters));
}

WireRig read(const schema::Rig& from) {
  return {text(from.name()), text(from.endpoint()), from.clock_offset_ns(), read(from.counters())};
}

Offset<schema::Forecast> build(FlatBufferBuilder& builder, const WireForecast& forecast) {
  if (forecast.frames == 0) return 0;
  std::vector<schema::RunWeight> runs;
  for (const RunWeight& run : forecast.runs) runs.emplace_back(run.simulation, run.weight);
  std::vector<schema::Parameter> parameters;
  for (const ParameterForecast& p : forecast.parameters) parameters.emplace_back(p.value, p.bound_90, p.r2);
  const auto run_vector = builder.CreateVectorOfStructs(runs);
  const auto branches = builder.CreateVector(forecast.branches);
  const auto parameter_vector = builder.CreateVectorOfStructs(parameters);
  return schema::CreateForecast(builder, forecast.frames, forecast.error_90, run_vector, branches, parameter_vector);
}

WireForecast read(const schema::Forecast* from) {
  WireForecast forecast;
  if (from == nullptr) return forecast;
  forecast.frames = from->frames();
  forecast.error_90 = from->error_90();
  if (from->runs() != nullptr)
    for (const auto* run : *from->runs()) forecast.runs.push_back({run->simulation(), run->weight()});
  if (from->branches() != nullptr) forecast.branches.assign(from->branches()->begin(), from->branches()->end());
  if (from->parameters() != nullptr)
    for (const auto* p : *from->parameters()) forecast.parameters.push_back({p->value(), p->bound_90(), p->r2()});
  return forecast;
}

Offset<schema::Sender> build(FlatBufferBuilder& builder, const WireSender& sender) {
  const Offset<flatbuffers::String> rig = sender.rig.empty() ? 0 : builder.CreateString(sender.rig);
  return schema::CreateSender(builder, sender.session, sender.first_id, sender.next_id, sender.received, sender.missed,
                              sender.withheld, static_cast<schema::SenderCondition>(sender.condition), rig);
}

WireSender read(const schema::Sender& from) {
  const auto condition = static_cast<SenderCondition>(from.condition());
  return {from.session(), from.first_id(), from.next_id(), from.received(),
          from.missed(),  from.withheld(), condition,      from.rig() == nullptr ? "" : from.rig()->str()};
}

Offset<schema::Recording> build(FlatBufferBuilder& builder, const std::optional<WireRecording>& recording) {
  if (!recording) return 0;
  return schema::CreateRecording(builder, static_cast<schema::RecordingPhase>(recording->phase), recording->bytes,
                                 recording->free_bytes);
}

std::optional<WireRecording> read(const schema::Recording* from) {
  if (from == nullptr) return std::nullopt;
  return WireRecording{static_cast<RecordingPhase>(from->phase()), from->bytes(), from->free_bytes()};
}

Offset<schema::ModelSummary> build(FlatBufferBuilder& builder, const ModelSummary& model) {
  const auto file = builder.CreateString(model.file);
  const auto unit = builder.CreateString(model.length_unit);
  const auto simulations = builder.CreateVectorOfStrings(model.simulations);
  return schema::CreateModelSummary(builder, file, model.checksum, model.vertices, model.modes, model.samples,
                                    model.references, unit, simulations);
}

ModelSummary read(const schema::ModelSummary* from) {
  ModelSummary model;
  if (from == nullptr) return model;
  model = {text(from->file()), from->checksum(),   from->vertices(),          from->modes(),
           from->samples(),    from->references(), text(from->length_unit()), {}};
  if (from->simulations() == nullptr) return model;
  for (const auto* name : *from->simulations()) model.simulations.push_back(text(name));
  return model;
}

Offset<schema::Component> build(FlatBufferBuilder& builder, const WireComponent& component) {
  const auto name = builder.CreateString(component.name);
  return schema::CreateComponent(builder, name, build(builder, component.model));
}

WireComponent read(const schema::Component& from) { return {text(from.name()), read(from.model())}; }

/// A vector of tables.
template <class Table, class T>
Offset<flatbuffers::Vector<Offset<Table>>> build_all(FlatBufferBuilder& builder, const std::vector<T>& from) {
  std::vector<Offset<Table>> built;
  built.reserve(from.size());
  for (const T& value : from) built.push_back(build(builder, value));
  return builder.CreateVector(built);
}

template <class Table, class T>
void read_all(const flatbuffers::Vector<Offset<Table>>* from, std::vector<T>& into) {
  if (from == nullptr) return;
  for (const Table* value : *from) into.push_back(read(*value));
}
}  // namespace

std::span<const std::byte> Encoder::result(const WireResult& result) {
  auto& builder = buffers_->cleared();
  const auto matches = build_all<schema::Match>(builder, result.matches);
  const auto counters = build(builder, result.counters);
  const auto coordinates = builder.CreateVector(result.leading_coordinates.data(),
                                                result.matches.empty() ? 0 : result.leading_coordinates.size());
  const auto fit = build(builder, result.fit);
  const auto test = build(builder, result.test);
  const auto forecast = build(builder, result.forecast);
  const auto channels = build(builder, result.channels);
  const auto rigs = result.rigs.empty() ? 0 : build_all<schema::RigFrame>(builder, result.rigs);
  const auto component = result.component.empty() ? 0 : builder.CreateString(result.component);
  const schema::PointTally points = build(result.points);
  const schema::StageTimes times = build(result.elapsed_ns);
  schema::ResultBuilder table(builder);
  table.add_model_checksum(result.model_checksum);
  table.add_publish_ns(result.publish_ns);
  table.add_receive_ns(result.receive_ns);
  table.add_stamp_ns(result.stamp_ns);
  table.add_frame_id(result.frame_id);
  table.add_session(result.session);
  table.add_sequence(result.sequence);
  if (!component.IsNull()) table.add_component(component);
  if (!rigs.IsNull()) table.add_rigs(rigs);
  if (!channels.IsNull()) table.add_channels(channels);
  table.add_forecast(forecast);
  table.add_test(test);
  table.add_fit(fit);
  table.add_leading_coordinates(coordinates);
  table.add_counters(counters);
  table.add_elapsed_ns(&times);
  table.add_matches(matches);
  table.add_points(&points);
  table.add_points_near_none(result.points_near_none);
  add<FrameNumbers>(builder, result, frame_numbers, frame_slots);
  table.add_reference(result.reference);
  table.add_verdict(static_cast<schema::Verdict>(result.verdict));
  table.add_status(static_cast<schema::WireStatus>(result.status));
  schema::FinishResultBuffer(builder, table.Finish());
  return detail::finished(builder);
}

WireStatus decode_result(std::span<const std::byte> message, WireResult& into) {
  std::vector<std::uint64_t> scratch;
  const auto [from, status] = detail::open<schema::Result>(message, schema::ResultIdentifier(), result_limits, scratch);
  if (from == nullptr) return status;
  into = {};
  into.sequence = from->sequence();
  into.session = from->session();
  into.frame_id = from->frame_id();
  into.stamp_ns = from->stamp_ns();
  into.status = static_cast<WireStatus>(from->status());
  into.verdict = static_cast<WireVerdict>(from->verdict());
  into.reference = from->reference();
  read<schema::Result, FrameNumbers>(from, into, frame_numbers, frame_slots);
  into.points = read(from->points());
  read_all(from->matches(), into.matches);
  into.elapsed_ns = read(from->elapsed_ns());
  into.counters = read(from->counters());
  into.receive_ns = from->receive_ns();
  into.publish_ns = from->publish_ns();
  into.model_checksum = from->model_checksum();
  if (from->leading_coordinates() != nullptr && from->leading_coordinates()->size() == into.leading_coordinates.size())
    std::copy(from->leading_coordinates()->begin(), from->leading_coordinates()->end(),
              into.leading_coordinates.begin());
  into.fit = read(from->fit());
  into.test = read(from->test());
  into.forecast = read(from->forecast());
  into.channels = read(from->channels());
  read_all(from->rigs(), into.rigs);
  into.component = text(from->component());
  into.points_near_none = from->points_near_none();
  return WireStatus::ok;
}

std::span<const std::byte> Encoder::state(const WireState& state) {
  auto& builder = buffers_->cleared();
  const auto version = builder.CreateString(state.version);
  const auto method = builder.CreateString(state.method);
  const auto counters = build(builder, state.counters);
  const auto model = build(builder, state.model);
  const auto senders = build_all<schema::Sender>(builder, state.senders);
  const auto rigs = state.rigs.empty() ? 0 : build_all<schema::Rig>(builder, state.rigs);
  const auto components = state.components.empty() ? 0 : build_all<schema::Component>(builder, state.components);
  const auto recording = build(builder, state.recording);
  schema::FinishStateBuffer(
      builder, schema::CreateState(builder, state.sequence, state.publish_ns, state.start_ns, version, method,
                                   state.max_points, state.queue_slots, state.queue_used, counters, model,
                                   state.max_message_bytes, senders, recording, rigs, components));
  return detail::finished(builder);
}

WireStatus decode_state(std::span<const std::byte> message, WireState& into) {
  std::vector<std::uint64_t> scratch;
  const auto [from, status] = detail::open<schema::State>(message, schema::StateIdentifier(), result_limits, scratch);
  if (from == nullptr) return status;
  into = {from->sequence(),       from->publish_ns(),  from->start_ns(),          text(from->version()),
          text(from->method()),   from->max_points(),  from->queue_slots(),       from->queue_used(),
          read(from->counters()), read(from->model()), from->max_message_bytes(), {},
          read(from->recording())};
  read_all(from->senders(), into.senders);
  read_all(from->rigs(), into.rigs);
  read_all(from->components(), into.components);
  return WireStatus::ok;
}
}  // namespace lbea::wire
