#include "tools/report/content/recording_reader.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "runtime/src/model/checksum.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/preview.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace lbea::tool {
namespace {

using Kind = RecordedMessage::Kind;

/// Counts the bytes that a visitor of messages has seen.
class ByteCount {
 public:
  ByteCount(const std::filesystem::path& file, const ReadingProgress& progress) : progress_(progress) {
    std::error_code unknown;
    const auto bytes = std::filesystem::file_size(file, unknown);
    total_ = unknown ? 0 : bytes;
  }
  void add(std::size_t bytes) {
    require_not_stopped();
    done_ += bytes;
    if (progress_) progress_(done_, total_);
  }

 private:
  const ReadingProgress& progress_;
  std::uint64_t done_ = 0, total_ = 0;
};

std::uint64_t checksum_of(const std::filesystem::path& file) {
  const io::InputFile input(file);
  std::vector<std::byte> block(std::size_t{1} << 20);
  RunningChecksum checksum;
  for (std::uint64_t at = 0; at < input.size(); at += block.size()) {
    require_not_stopped();
    const auto part = std::span(block).first(std::min<std::uint64_t>(block.size(), input.size() - at));
    input.read(at, part);
    checksum.add(part);
  }
  return checksum.value();
}

/// The points of a recorded cloud; nothing when it is damaged.
std::vector<Point> points_of(const RecordedMessage& message, const RigidTransform& T_reference_sensor) {
  wire::Encoder encoder;
  wire::DecodedFrame frame;
  const auto status = wire::decode_frame(encoder.frame_of_cloud(message.data, message.session, message.id), frame,
                                         {.max_points = wire::WireLimits::most_points});
  if (status != wire::WireStatus::ok) return {};
  thin(frame.points, RecordedFrame::most_points, T_reference_sensor);
  return std::move(frame.points);
}

/// Where the points of a frame are put, and their pose.
struct CloudUse {
  CaptureKey capture;
  RigidTransform T_reference_sensor = identity_transform;
  bool is_done = false;
};

/// By frames. Results follow their frames in the file, so it is read once more for them.
std::map<CaptureKey, CloudUse> uses_in_captures(const std::filesystem::path& file, std::span<const CaptureKey> wanted,
                                                std::span<const RigSettings> rigs) {
  std::map<CaptureKey, CloudUse> uses;
  wire::WireResult result;
  static_cast<void>(audit_run(file, [&](const RecordedMessage& message) {
    require_not_stopped();
    if (message.kind != Kind::result || wire::decode_result(message.data, result) != wire::WireStatus::ok) return;
    const CaptureKey capture{result.session, result.frame_id};
    if (std::ranges::find(wanted, capture) == wanted.end()) return;
    for (const wire::WireRigFrame& frame : result.rigs) {
      const auto rig = std::ranges::find(rigs, frame.rig, &RigSettings::name);
      if (rig != rigs.end() && frame.is_used)
        uses[{frame.session, frame.frame_id}] = {capture, rig->T_reference_sensor};
    }
  }));
  return uses;
}

}  // namespace

void require_not_stopped() {
  if (stop_requested != 0) throw Error(Status::write_failed, "stopped; no report was written");
}

void TestCollector::add(const wire::WireResult& result) {
  const auto current = current_.find(result.session);
  const bool is_known = current != current_.end();
  if (wire::fate_of(result.status) != wire::Fate::matched) {
    if (is_known) content_.tests[current->second].record.add(result);
    return;
  }
  if (content_.model_checksum == 0) content_.model_checksum = result.model_checksum;
  const bool is_next = is_known && content_.tests[current->second].record.has_ended();
  if (is_known && !is_next) return content_.tests[current->second].record.add(result);
  if (content_.tests.size() >= RecordingContent::most_tests) return void(++content_.omitted_tests);
  const std::uint64_t number = is_next ? content_.tests[current->second].key.second + 1 : 0;
  current_[result.session] = content_.tests.size();
  content_.tests.push_back({{result.session, number}, TestRecord(content_.rows_per_test)});
  content_.tests.back().record.add(result);
}

RecordingContent read_recording(const std::filesystem::path& file, const ReadingProgress& progress,
                                std::size_t rows_per_test) {
  RecordingContent content;
  content.rows_per_test = rows_per_test;
  content.file = file;
  TestCollector tests(content);
  ByteCount bytes(file, progress);
  wire::WireResult result;
  wire::WireState state;
  content.audit = audit_run(file, [&](const RecordedMessage& message) {
    bytes.add(message.data.size());
    if (message.kind == Kind::result && wire::decode_result(message.data, result) == wire::WireStatus::ok)
      tests.add(result);
    if (message.kind == Kind::state && content.matcher_names.empty() &&
        wire::decode_state(message.data, state) == wire::WireStatus::ok)
      content.matcher_names = state.model.simulations;
  });
  if (!content.audit.file.is_mcap)
    throw Error(Status::bad_input, file.string() + ": not a recording (MCAP); check the name");
  content.checksum = checksum_of(file);
  return content;
}

std::map<CaptureKey, RecordedFrame> read_frames(const std::filesystem::path& file, std::span<const CaptureKey> wanted,
                                                const RigidTransform& T_reference_sensor,
                                                std::span<const RigSettings> rigs, const ReadingProgress& progress) {
  std::map<CaptureKey, RecordedFrame> frames;
  std::map<CaptureKey, CloudUse> uses;
  for (const CaptureKey& key : wanted) {
    frames[key] = {};
    uses[key] = {key, T_reference_sensor};
  }
  if (!rigs.empty()) uses = uses_in_captures(file, wanted, rigs);
  ByteCount bytes(file, progress);
  wire::WireResult result;
  static_cast<void>(audit_run(file, [&](const RecordedMessage& message) {
    bytes.add(message.data.size());
    if (message.kind == Kind::frame) {
      const auto use = uses.find({message.session, message.id});
      if (use != uses.end() && !std::exchange(use->second.is_done, true))
        std::ranges::copy(points_of(message, use->second.T_reference_sensor),
                          std::back_inserter(frames[use->second.capture].points));
    }
    if (message.kind != Kind::result || wire::decode_result(message.data, result) != wire::WireStatus::ok) return;
    const auto frame = frames.find({result.session, result.frame_id});
    if (frame == frames.end() || frame->second.result || wire::fate_of(result.status) != wire::Fate::matched) return;
    frame->second.result = result;
  }));
  return frames;
}

}  // namespace lbea::tool
