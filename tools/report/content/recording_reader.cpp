#include "tools/report/content/recording_reader.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "runtime/src/model/checksum.hpp"
#include "tools/shared/answer/component_results.hpp"
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

std::vector<RecordingContent*> TestCollector::concerned(const wire::WireResult& result) const {
  std::vector<RecordingContent*> all;
  for (RecordingContent& content : contents_)
    if (!content.component || concerns(result, *content.component)) all.push_back(&content);
  return all;
}

/// False when there are too many.
bool TestCollector::begin_test(std::uint64_t session) {
  const auto current = current_.find(session);
  const std::vector<RecordedTest>& tests = contents_.front().tests;
  if (tests.size() >= RecordingContent::most_tests) return false;
  const std::uint64_t number = current != current_.end() ? tests[current->second].key.second + 1 : 0;
  current_[session] = tests.size();
  for (RecordingContent& content : contents_)
    content.tests.push_back({{session, number}, TestRecord(content.rows_per_test)});
  return true;
}

void TestCollector::add(const wire::WireResult& result) {
  const std::vector<RecordingContent*> of = concerned(result);
  if (of.empty()) return;
  const auto current = current_.find(result.session);
  const bool is_known = current != current_.end();
  if (wire::fate_of(result.status) == wire::Fate::matched) {
    for (RecordingContent* content : of)
      if (content->model_checksum == 0) content->model_checksum = result.model_checksum;
    const bool begins = !is_known || contents_.front().tests[current->second].record.has_ended();
    if (begins && !begin_test(result.session)) {
      for (RecordingContent* content : of) ++content->omitted_tests;
      return;
    }
  } else if (!is_known) {
    return;
  }
  for (RecordingContent* content : of) content->tests[current_[result.session]].record.add(result);
}

namespace {

void read_all(std::span<RecordingContent> contents, const std::filesystem::path& file,
              const ReadingProgress& progress) {
  TestCollector tests(contents);
  ByteCount bytes(file, progress);
  wire::WireResult result;
  RunAudit audit = audit_run(file, [&](const RecordedMessage& message) {
    bytes.add(message.data.size());
    if (message.kind == Kind::result && wire::decode_result(message.data, result) == wire::WireStatus::ok)
      tests.add(result);
  });
  if (!audit.file.is_mcap) throw Error(Status::bad_input, file.string() + ": not a recording (MCAP); check the name");
  const std::uint64_t checksum = checksum_of(file);
  for (RecordingContent& content : contents) {
    content.file = file;
    content.checksum = checksum;
    content.audit = audit;
  }
}

}  // namespace

RecordingContent read_recording(const std::filesystem::path& file, const ReadingProgress& progress,
                                std::size_t rows_per_test) {
  RecordingContent content;
  content.rows_per_test = rows_per_test;
  read_all(std::span(&content, 1), file, progress);
  return content;
}

std::vector<RecordingContent> read_components(const std::filesystem::path& file,
                                              std::span<const std::uint64_t> checksums, const ReadingProgress& progress,
                                              std::size_t rows_per_test) {
  std::vector<RecordingContent> contents(checksums.size());
  for (std::size_t i = 0; i < contents.size(); ++i) {
    contents[i].rows_per_test = rows_per_test;
    contents[i].component = checksums[i];
  }
  read_all(contents, file, progress);
  return contents;
}

std::map<CaptureKey, RecordedFrame> read_frames(const std::filesystem::path& file, std::span<const CaptureKey> wanted,
                                                const RigidTransform& T_reference_sensor,
                                                std::span<const RigSettings> rigs,
                                                std::optional<std::uint64_t> component,
                                                const ReadingProgress& progress) {
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
    if (component && !concerns(result, *component)) return;
    const auto frame = frames.find({result.session, result.frame_id});
    if (frame == frames.end() || frame->second.result || wire::fate_of(result.status) != wire::Fate::matched) return;
    frame->second.result = result;
  }));
  return frames;
}

}  // namespace lbea::tool
