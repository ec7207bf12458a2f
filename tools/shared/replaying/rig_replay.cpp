#include "tools/shared/replaying/rig_replay.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

std::vector<Rig> rigs_of(const RunSettings& settings, const std::vector<SensorViews>& views) {
  std::vector<Rig> rigs;
  for (std::size_t i = 0; i < settings.rigs.size(); ++i)
    rigs.push_back({settings.rigs[i].T_reference_sensor, views[i], settings.rigs[i].clock_offset_ns});
  return rigs;
}

}  // namespace

RigReplay::RigReplay(const Model& model, const RunSettings& settings, const std::vector<SensorViews>& views,
                     const FrameFates& fates, unsigned threads)
    : model_(model),
      fates_(fates),
      engine_(model, settings.matcher, rigs_of(settings, views),
              {true, settings.estimates_pose != 0, settings.knows_impact != 0}),
      threads_(std::min<std::size_t>(settings.rigs.size(), threads)),
      decoder_(wire::WireLimits{.max_points = settings.matcher.max_points}) {
  engine_.use_threads(threads_.for_rigs());
  for (const RigSettings& rig : settings.rigs) rigs_.emplace(rig.name, rigs_.size());
  for (const RecordedCapture& capture : fates.captures()) {
    if (!fates.has_frame(capture.key)) continue;  // one is outside the recorded window, or was lost
    captures_.push_back(&capture);
    in_captures_.insert(capture.frames.begin(), capture.frames.end());
    for (const std::string& rig : capture.rigs)
      if (!rigs_.contains(rig))
        throw Error(Status::bad_input, "a recorded result rests on a frame of rig \"" + rig +
                                           "\", which the recording does not describe; see lbea-inspect");
  }
  reserve(outcome_, settings.matcher.max_matches);
}

bool RigReplay::add(const RecordedMessage& frame, std::int64_t from_ns, const ResultHandler& handle) {
  const FrameKey key{frame.session, frame.id};
  if (in_captures_.erase(key) == 0) {  // or a repeated id
    ++left_out_;
    return true;
  }
  Cloud& cloud = clouds_[key];
  if (decoder_.open(encoder_.frame_of_cloud(frame.data, frame.session, frame.id)) != wire::WireStatus::ok)
    throw Error(Status::bad_input, "the matcher has matched frame " + std::to_string(frame.id) +
                                       " of a rig, whose recorded cloud cannot be read; see lbea-inspect");
  cloud.header = decoder_.header();
  cloud.points.resize(cloud.header.points);
  decoder_.read_points(cloud.points);
  cloud.receive_ns = frame.log_time_ns;
  for (; next_ < captures_.size() && is_complete(*captures_[next_]); ++next_) {
    const RecordedCapture& capture = *captures_[next_];
    const wire::WireResult result = match(capture);
    for (const FrameKey& matched : capture.frames) clouds_.erase(matched);
    if (capture.receive_ns >= from_ns && !handle(result, fates_.test_of(capture.key))) return false;
  }
  return true;
}

bool RigReplay::is_complete(const RecordedCapture& capture) const {
  return std::ranges::all_of(capture.frames, [this](const FrameKey& frame) { return clouds_.contains(frame); });
}

wire::WireResult RigReplay::match(const RecordedCapture& capture) {
  const TestKey test = fates_.test_of(capture.key);
  if (std::exchange(test_, test) != test) engine_.begin_test();
  threads_.run(capture.frames.size(), [&](std::size_t i) {
    const Cloud& cloud = clouds_.at(capture.frames[i]);
    engine_.match_alone(rigs_.at(capture.rigs[i]), {cloud.header.id, cloud.header.stamp_ns, cloud.points});
  });
  clear(outcome_);
  fill_capture(outcome_, engine_, engine_.combine(), capture.key.first, capture.key.second);
  for (std::size_t i = 0; i < capture.frames.size(); ++i) {
    outcome_.result.rigs.push_back(frame_of(capture, i));
    fill_rig_frame(outcome_.result.rigs.back(), engine_.rigs()[rigs_.at(capture.rigs[i])]);
  }
  wire::WireResult result;
  compose(outcome_, engine_, result);
  complete_verdict(result);
  result.receive_ns = capture.receive_ns;
  result.sequence = sequence_++;
  result.model_checksum = model_.checksum();
  result.elapsed_ns = {};
  return result;
}

/// Its names.
wire::WireRigFrame RigReplay::frame_of(const RecordedCapture& capture, std::size_t i) const {
  const Cloud& cloud = clouds_.at(capture.frames[i]);
  wire::WireRigFrame frame;
  frame.rig = capture.rigs[i];
  frame.session = capture.frames[i].first;
  frame.frame_id = capture.frames[i].second;
  frame.stamp_ns = cloud.header.stamp_ns;
  return frame;
}

}  // namespace lbea::tool
