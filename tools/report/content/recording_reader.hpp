// What the report reads from a recording: the audit of the whole file, the results of each test, and single frames.
// Damaged recordings are read as far as they are sound.
#pragma once

#include "tools/report/content/test_record.hpp"
#include "tools/shared/recording/run_audit.hpp"

namespace lbea::tool {

/// Session and id.
using CaptureKey = std::pair<std::uint64_t, std::uint64_t>;

struct RecordedTest {
  TestKey key;
  TestRecord record;
};

struct RecordingContent {
  std::filesystem::path file;
  std::uint64_t checksum = 0;  // XXH3-64 of all bytes
  RunAudit audit;
  std::vector<RecordedTest> tests;         // with at least one matched frame, in their order
  std::uint64_t omitted_tests = 0;         // beyond most_tests
  std::uint64_t model_checksum = 0;        // of the first matched result
  std::vector<std::string> matcher_names;  // of the simulations, as the matcher named them
  std::size_t rows_per_test = TestRecord::default_capacity;
  static constexpr std::size_t most_tests = 256;
};

/// Throws Error{write_failed} after Ctrl-C.
void require_not_stopped();

/// Called with the bytes read so far and all bytes.
using ReadingProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Throws Error{file_not_found | bad_input} when it is not a recording, and when stopped.
[[nodiscard]] RecordingContent read_recording(const std::filesystem::path& file, const ReadingProgress& progress,
                                              std::size_t rows_per_test = TestRecord::default_capacity);

/// Divides results into tests: the first matched frame of another session, or after the end of its stream, begins
/// another one.
class TestCollector {
 public:
  explicit TestCollector(RecordingContent& content) : content_(content) {}
  void add(const wire::WireResult& result);

 private:
  RecordingContent& content_;
  std::map<std::uint64_t, std::size_t> current_;  // by session: place in content_.tests
};

/// A frame with its points.
struct RecordedFrame {
  std::optional<wire::WireResult> result;  // none: not recorded
  std::vector<Point> points;               // transformed, at most `most_points` of them; empty: not recorded
  static constexpr std::uint32_t most_points = 20'000;
};

/// The frames with these keys. Of repeated ids, the first one counts. With several `rigs`, whose poses then count, a
/// key is that of a capture, whose frames' points are put together.
[[nodiscard]] std::map<CaptureKey, RecordedFrame> read_frames(const std::filesystem::path& file,
                                                              std::span<const CaptureKey> wanted,
                                                              const RigidTransform& T_reference_sensor,
                                                              std::span<const RigSettings> rigs,
                                                              const ReadingProgress& progress);

}  // namespace lbea::tool
