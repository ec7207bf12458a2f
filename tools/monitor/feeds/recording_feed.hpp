// A recording to look at afterwards: its frames one by one, the curves of its tests.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/monitor/web/exports.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <map>
#include <mutex>

namespace lbea::tool {

class RecordingFeed final : public Feed {
 public:
  /// Reads the whole file once. Throws Error{file_not_found | bad_input}.
  RecordingFeed(const std::filesystem::path& file, Model model);

  /// A recording does not change: nothing comes by itself.
  [[nodiscard]] std::string rows_after(LogCursor&) override { return {}; }
  /// "/api/recording/rows?session=S&first=N", "/api/recording/frame?number=N", and what the model has.
  [[nodiscard]] std::optional<HttpAnswer> answer(std::string_view target) override;
  [[nodiscard]] std::size_t frames() const noexcept { return entries_.size(); }

 private:
  struct Entry {
    std::int64_t frame_ns = 0, result_ns = 0;  // log times; the former 0 when the recording lacks the frame
    std::uint64_t session = 0, id = 0;
  };
  void read_all();
  void note_result(const RecordedMessage& message,
                   const std::map<std::pair<std::uint64_t, std::uint64_t>, std::int64_t>& frames);
  [[nodiscard]] std::string model_answer() const;
  [[nodiscard]] std::string frame_packet(const Entry& entry);
  [[nodiscard]] std::string rows_packet(std::string_view target) const;
  [[nodiscard]] wire::WireResult result_of(const Entry& entry);
  [[nodiscard]] std::shared_ptr<const std::vector<Point>> cloud_of(const Entry& entry);
  [[nodiscard]] const TestLog& log_of(std::uint64_t session) const;

  std::string name_, words_;
  Model model_;
  ModelRanges ranges_;
  ModelExports exports_;
  std::mutex mutex_;  // of what reads
  RecordedRun run_;
  SceneBuilder scenes_;
  Health health_;
  Health::Clock::time_point whole_ =
      Health::Clock::now();  // one moment for all of it: the latencies are the whole recording's
  std::vector<Entry> entries_;
  std::map<std::uint64_t, TestLog> logs_;
};

/// What a recording or a matcher says of the model it was matched with, opened. Throws Error when it is not there or is
/// another one by now.
[[nodiscard]] Model open_model(const std::string& file, std::uint64_t checksum);

}  // namespace lbea::tool
