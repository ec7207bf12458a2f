#include "adapters/recording/recorder_account.hpp"

namespace lbea {

namespace {

std::string lane_json(const RecorderStatus::Lane& lane) {
  return "{\"no_room\":" + std::to_string(lane.no_room) + ",\"write_failed\":" + std::to_string(lane.write_failed) + "}";
}

}  // namespace

std::string account_json(const RecorderStatus& status) {
  return "{\"state\":\"" + std::string(to_string(status.state)) + "\",\"lost_frames\":" + lane_json(status.frames) +
         ",\"lost_notes\":" + lane_json(status.notes) + ",\"failed_syncs\":" + std::to_string(status.failed_syncs) + "}";
}

std::string_view account_schema() noexcept {
  return R"({"title":"lbea.Recorder","description":"What the recorder lost so far, written when it changes",)"
         R"("type":"object","properties":{"state":{"type":"string"},)"
         R"("lost_frames":{"$ref":"#/$defs/lost"},"lost_notes":{"$ref":"#/$defs/lost"},)"
         R"("failed_syncs":{"type":"integer"}},"$defs":{"lost":{"type":"object","properties":{)"
         R"("no_room":{"type":"integer"},"write_failed":{"type":"integer"}}}}})";
}

mcap::Metadata closing_metadata(const RecorderStatus& status) {
  const auto text = [](std::uint64_t number) { return std::to_string(number); };
  return {std::string(closing_metadata_name),
          {{"frames_recorded", text(status.frames.recorded)},
           {"frames_lost_no_room", text(status.frames.no_room)},
           {"frames_lost_write_failed", text(status.frames.write_failed)},
           {"notes_recorded", text(status.notes.recorded)},
           {"notes_lost_no_room", text(status.notes.no_room)},
           {"notes_lost_write_failed", text(status.notes.write_failed)},
           {"failed_syncs", text(status.failed_syncs)}}};
}

}  // namespace lbea
