#include "tools/replay/replay_settings.hpp"

#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/text/formatted.hpp"

#include <cmath>

namespace lbea::tool {
namespace {

constexpr double longest_s = 4e9;

std::optional<double> seconds(std::string_view text, double if_empty) {
  if (text.empty()) return if_empty;
  const auto value = parsed<double>(text);
  return value && std::abs(*value) <= longest_s ? value : std::nullopt;
}

std::optional<RecordedMessage> next_frame(RecordedRun& run) {
  auto message = run.next();
  while (message && message->kind != RecordedMessage::Kind::frame) message = run.next();
  return message;
}

}  // namespace

Range::Range(const std::string& words) : text(words), from_s(-longest_s), to_s(longest_s) {
  if (text.empty()) return;
  const auto colon = text.find(':');
  const std::string_view view = text;
  const auto from = seconds(view.substr(0, colon), -longest_s), to = seconds(view.substr(colon + 1), longest_s);
  if (colon == std::string::npos || !from || !to)
    throw WrongUsage("--range \"" + text + "\": not FROM:TO in seconds; write e.g. 0.5:2");
  if (*from > *to) throw WrongUsage("--range \"" + text + "\": it ends before it begins; write FROM:TO, e.g. 0.5:2");
  from_s = *from;
  to_s = *to;
}

Part part_of(RecordedRun& run, const Range& range, const std::string& file) {
  run.rewind();
  const auto first = next_frame(run);
  if (!first) throw Error(Status::bad_input, file + ": it contains no frame; see lbea-inspect");
  if (range.text.empty()) return {};
  const std::int64_t begin = first->log_time_ns;
  const Part part{saturated_sum(begin, static_cast<std::int64_t>(range.from_s * 1e9)),
                  saturated_sum(begin, static_cast<std::int64_t>(range.to_s * 1e9)), false};
  run.rewind();
  run.limit(part.from_ns, part.to_ns);
  if (!next_frame(run))
    throw Error(Status::bad_input,
                file + ": no frame in --range " + range.text +
                    ", seconds after the first frame; lbea-inspect prints the length of the recording");
  run.limit(Part{}.from_ns, Part{}.to_ns);
  return part;
}

std::int64_t history_of(RecordedRun& run, const Part& part, const FrameFates& fates) {
  std::int64_t begin = part.from_ns;
  std::optional<TestKey> test;
  run.rewind();
  while (const auto frame = next_frame(run)) {
    if (fates.was_dropped({frame->session, frame->id})) continue;
    const TestKey test_now = fates.test_of({frame->session, frame->id});
    if (std::exchange(test, test_now) != test_now) begin = frame->log_time_ns;
    if (frame->log_time_ns >= part.from_ns) break;
  }
  return std::min(begin, part.from_ns);
}

}  // namespace lbea::tool
