// The results of one test as the report shows them: a row per frame, thinned in long tests, and what the whole test
// says.
#pragma once

#include "tools/report/content/channels/channel_record.hpp"
#include "tools/shared/answer/test_answer.hpp"

#include <map>
#include <span>

namespace lbea::tool {

/// What the curves show of a frame. NaN: unknown, or the frame was rejected.
struct FrameRow : FrameNumbers, FitNumbers {
  static constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  std::uint64_t id = 0;
  double time_s = 0;  // since the first matched frame, by the stamps
  wire::WireVerdict verdict = wire::WireVerdict::refused;
  float distance = unknown;
  double match_time_s = static_cast<double>(unknown);  // of the best sample in its simulation
  float test_misfit = unknown;                         // of the test up to this frame
  std::vector<wire::SimulationChance> chances;         // the likeliest simulations of the test up to this frame
  std::vector<float> branches;                         // probabilities
  float final_error_90 = unknown;                      // of the forecast's final shape
  std::vector<float> final_branches;                   // forecast: probabilities at the end
  std::vector<ParameterForecast> parameters;           // forecast
  std::vector<ChannelOfFrame> channels;                // in the order of the record's; empty: doubtful
  [[nodiscard]] bool is_matched() const noexcept { return verdict != wire::WireVerdict::refused; }
};

class TestRecord {
 public:
  static constexpr std::size_t default_capacity = 8192;
  explicit TestRecord(std::size_t capacity = default_capacity) : capacity_(capacity) {}

  /// Results of this test alone, in their order.
  void add(const wire::WireResult& result);

  [[nodiscard]] std::span<const FrameRow> rows() const noexcept { return rows_; }
  /// Frames per row: 1, 2, 4, ...
  [[nodiscard]] std::size_t every() const noexcept { return every_; }
  [[nodiscard]] const TestAnswer& answer() const noexcept { return answer_; }
  /// The last matched frame; nothing before it.
  [[nodiscard]] const std::optional<wire::WireResult>& latest() const noexcept { return latest_; }
  /// Number of frames by verdict, rejected ones included.
  [[nodiscard]] const std::map<wire::WireVerdict, std::uint64_t>& verdicts() const noexcept { return verdicts_; }
  [[nodiscard]] const ChannelRecord& channels() const noexcept { return channels_; }
  /// From the first to the last matched frame.
  [[nodiscard]] double seconds() const noexcept { return seconds_; }
  /// The sender announced the end of the test.
  [[nodiscard]] bool has_ended() const noexcept { return has_ended_; }

 private:
  [[nodiscard]] FrameRow row_of(const wire::WireResult& result) const;
  void thin();
  std::size_t capacity_, every_ = 1;
  std::uint64_t frames_ = 0;
  std::int64_t first_stamp_ns_ = 0;
  double seconds_ = 0;
  bool has_ended_ = false;
  TestAnswer answer_;
  std::optional<wire::WireResult> latest_;
  std::map<wire::WireVerdict, std::uint64_t> verdicts_;
  ChannelRecord channels_;
  std::vector<FrameRow> rows_;
};

}  // namespace lbea::tool
