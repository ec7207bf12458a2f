// A recording: its frames one by one, and the curves of its tests.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <map>
#include <mutex>

namespace lbea::tool {

class RecordingFeed final : public Feed {
 public:
  /// Reads the whole file once. Throws Error{file_not_found | bad_input}.
  RecordingFeed(const std::filesystem::path& file, Model model);

  /// A recording does not change, so there are no further rows.
  [[nodiscard]] std::string rows_after(LogCursor&) override { return {}; }
  /// "/api/recording/rows?session=S&first=N", "/api/recording/frame?number=N", and the exports of the model.
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) override;
  [[nodiscard]] std::size_t frames() const noexcept { return entries_.size(); }

 private:
  struct Entry {
    std::int64_t frame_ns = 0, result_ns = 0;  // log times; the former 0 when the recording lacks the frame
    std::uint64_t session = 0, id = 0;
  };
  using FrameTimes = std::map<std::pair<std::uint64_t, std::uint64_t>, std::int64_t>;  // by session and frame id
  void read_all();
  void add_result(const RecordedMessage& message, const FrameTimes& frames);
  [[nodiscard]] std::string frame_packet(const Entry& entry);
  [[nodiscard]] std::string rows_packet(std::string_view target) const;
  [[nodiscard]] wire::WireResult result_of(const Entry& entry);
  [[nodiscard]] std::shared_ptr<const std::vector<Point>> cloud_of(const Entry& entry);
  [[nodiscard]] const TestLog& log_of(std::uint64_t session) const;

  std::string name_, audit_;
  Model model_;
  ModelRanges ranges_;
  ModelExports exports_;
  std::mutex mutex_;  // of the members below
  RecordedRun run_;
  SceneBuilder scenes_;
  Health health_;
  // One time for all results, so that the latencies are those of the whole recording.
  Health::Clock::time_point time_ = Health::Clock::now();
  std::vector<Entry> entries_;
  std::map<std::uint64_t, TestLog> logs_;
};

/// Opens the model that a recording or a matcher names. Throws Error when the file is missing or is another model.
[[nodiscard]] Model open_model(const std::string& file, std::uint64_t checksum);

}  // namespace lbea::tool
