#include "tools/shared/recording/run_recorder.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <charconv>
#include <new>

namespace lbea::tool {
namespace {

constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

std::string hexadecimal(std::uint64_t number) {
  std::array<char, 16> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number, 16).ptr;
  return {digits.data(), end};
}

mcap::Schema flatbuffer_schema(std::uint16_t id, const char* name, std::span<const std::byte> compiled) {
  return {id, name, "flatbuffer", mcap::Buffer(compiled.begin(), compiled.end())};
}

mcap::Channel channel(std::uint16_t id, std::uint16_t schema, std::string_view topic, const char* encoding,
                      mcap::Texts metadata = {}) {
  return {id, schema, std::string(topic), encoding, std::move(metadata)};
}

RecordingStart start_of(const RunSettings& settings) {
  RecordingStart start;
  start.header = {std::string(recording_profile), "lbea " LBEA_VERSION_STRING};
  const auto report = std::as_bytes(std::span(loss_report_schema()));
  start.schemas = {flatbuffer_schema(results_schema_id, "lbea.wire.Result", wire::result_schema()),
                   flatbuffer_schema(state_schema_id, "lbea.wire.State", wire::state_schema()),
                   {recorder_schema_id, "lbea.Recorder", "jsonschema", {report.begin(), report.end()}},
                   flatbuffer_schema(frames_schema_id, "foxglove.PointCloud", wire::point_cloud_schema())};
  start.channels = {channel(results_channel, results_schema_id, results_topic, "flatbuffer"),
                    channel(state_channel, state_schema_id, state_topic, "flatbuffer"),
                    channel(recorder_channel, recorder_schema_id, recorder_topic, "json")};
  start.metadata = {to_metadata(settings)};
  for (std::size_t rig = 0; rig < settings.rigs.size(); ++rig)
    start.metadata.push_back(to_metadata(settings.rigs[rig], rig));
  for (std::size_t i = 0; i < settings.components.size(); ++i)
    start.metadata.push_back(to_metadata(settings.components[i], i));
  start.status_channel = recorder_channel;
  return start;
}

std::uint64_t time_of(std::int64_t ns) { return static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0)); }

}  // namespace

RunRecorder::RunRecorder(const std::filesystem::path& file, const RecorderConfig& config, const RunSettings& settings)
    : RunRecorder(std::make_unique<mcap::PartialFile>(file), config, settings) {
  folder_ = std::filesystem::absolute(file).parent_path();
  update_free_space();
}

RunRecorder::RunRecorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RunSettings& settings)
    : recorder_(std::move(sink), config, start_of(settings)), trigger_stamp_ns_(never) {
  for (const RigSettings& rig : settings.rigs) rigs_.push_back(rig.name);
  channels_.reserve(max_frame_channels);
}

void RunRecorder::frame_of_test(std::int64_t stamp_ns, std::int64_t receive_ns) noexcept {
  if (stamp_ns >= trigger_stamp_ns_) recorder_.trigger(receive_ns);
}

void RunRecorder::frame(wire::Message, const wire::FrameHeader& header, const Arrival& arrival) noexcept {
  if (header.cloud.empty()) return;  // without a cloud: its result contains the reason, or it is the end of the stream
  const std::uint16_t channel = channel_of(header.session, header.id, arrival.rig);
  if (channel == 0) {
    ++without_channel_;
    return;
  }
  recorder_.put(Recorder::Queue::frames, {channel, static_cast<std::uint32_t>(header.id), time_of(arrival.receive_ns),
                                          time_of(header.stamp_ns), header.cloud});
}

std::uint16_t RunRecorder::channel_of(std::uint64_t session, std::uint64_t id, std::uint32_t rig) noexcept {
  const auto id_high = static_cast<std::uint32_t>(id >> 32);
  const auto known = std::find_if(channels_.rbegin(), channels_.rend(), [&](const FrameChannel& c) {
    return c.session == session && c.id_high == id_high && c.rig == rig;
  });
  if (known != channels_.rend()) return known->channel;
  if (channels_.size() == max_frame_channels) return 0;
  const auto next = static_cast<std::uint16_t>(first_frames_channel + channels_.size());
  mcap::Buffer record;
  try {
    mcap::Texts texts{{std::string(session_key), hexadecimal(session)},
                      {std::string(id_high_key), hexadecimal(id_high)}};
    std::string topic(frames_topic);
    if (rig < rigs_.size()) {
      topic += "/" + rigs_[rig];
      texts[std::string(rig_key)] = rigs_[rig];
    }
    mcap::append(record, channel(next, frames_schema_id, topic, "flatbuffer", texts));
  } catch (const std::bad_alloc&) {
    return 0;  // this frame is lost and counted; the next one is another attempt
  }
  if (!recorder_.put_channel(Recorder::Queue::frames, record)) return 0;
  channels_.push_back({session, id_high, rig, next});
  return next;
}

void RunRecorder::result(wire::Message message, const wire::WireResult& result) noexcept {
  const std::uint64_t time = time_of(result.publish_ns);
  recorder_.put(Recorder::Queue::notes,
                {results_channel, static_cast<std::uint32_t>(result.sequence), time, time, message});
}

void RunRecorder::state(wire::Message message, const wire::WireState& state) noexcept {
  const std::uint64_t time = time_of(state.publish_ns);
  recorder_.put(Recorder::Queue::notes,
                {state_channel, static_cast<std::uint32_t>(state.sequence), time, time, message});
}

RunObserver::Counts RunRecorder::counts() const noexcept {
  const RecorderStatus status = recorder_.status();
  return {status.frames.recorded, status.lost() + without_channel_};
}

std::optional<wire::WireRecording> RunRecorder::recording() const noexcept {
  const RecorderStatus status = recorder_.status();
  const bool is_whole = status.is_sound() && without_channel_ == 0;
  return wire::WireRecording{is_whole ? status.phase : wire::RecordingPhase::failed, status.bytes, free_bytes_};
}

void RunRecorder::update_free_space() noexcept {
  if (folder_.empty()) return;
  std::error_code error;
  const auto space = std::filesystem::space(folder_, error);
  free_bytes_ = error ? wire::WireRecording::unknown : space.available;
}

void RunRecorder::trigger_now() noexcept { recorder_.trigger(wire::wall_clock_ns()); }

}  // namespace lbea::tool
