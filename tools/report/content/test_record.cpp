#include "tools/report/content/test_record.hpp"

#include "tools/shared/answer/clock_times.hpp"

namespace lbea::tool {
namespace {

bool is_matched(const wire::WireResult& result) { return wire::fate_of(result.status) == wire::Fate::matched; }

}  // namespace

void TestRecord::add(const wire::WireResult& result) {
  answer_.add(result);
  if (result.status == wire::WireStatus::end_of_stream) has_ended_ = true;
  const wire::Fate fate = wire::fate_of(result.status);
  if (fate != wire::Fate::matched && fate != wire::Fate::rejected) return;
  if (is_matched(result)) {
    if (!latest_) first_stamp_ns_ = result.stamp_ns;
    seconds_ = difference_ns(result.stamp_ns, first_stamp_ns_) * 1e-9;
    latest_ = result;
  } else if (!latest_) {
    return;  // no time to refer to
  }
  FrameRow row = row_of(result);
  row.channels = channels_.add(result, row.time_s);
  ++verdicts_[row.verdict];
  if (frames_++ % every_ != 0) return;
  if (rows_.size() >= capacity_) thin();
  rows_.push_back(std::move(row));
}

// A rejected frame may have no time; it gets that of the frame before it.
FrameRow TestRecord::row_of(const wire::WireResult& result) const {
  FrameRow row;
  row.id = result.frame_id;
  if (!is_matched(result)) {
    row.coverage = FrameRow::unknown;
    row.time_s = rows_.empty() ? 0 : rows_.back().time_s;
    return row;
  }
  row.time_s = seconds_;
  row.verdict = result.verdict;
  static_cast<FrameNumbers&>(row) = result;
  if (!result.fit.candidates.empty()) static_cast<FitNumbers&>(row) = result.fit;
  if (!result.matches.empty()) {
    row.distance = result.matches.front().distance;
    row.match_time_s = result.matches.front().time_s;
  }
  if (result.test.frames > 0) {
    row.test_misfit = result.test.misfit;
    row.chances = result.test.simulations;
    row.branches = result.test.branches;
  }
  if (result.forecast.frames > 0) {
    row.final_error_90 = result.forecast.error_90;
    row.final_branches = result.forecast.branches;
    row.parameters = result.forecast.parameters;
  }
  return row;
}

void TestRecord::thin() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rows_.size(); i += 2, ++kept)
    if (kept != i) rows_[kept] = std::move(rows_[i]);
  rows_.resize(kept);
  every_ *= 2;
}

}  // namespace lbea::tool
