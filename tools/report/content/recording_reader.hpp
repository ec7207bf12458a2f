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
  std::vector<RecordedTest> tests;   // with at least one matched frame, in their order
  std::uint64_t omitted_tests = 0;   // beyond most_tests
  std::uint64_t model_checksum = 0;  // of the first matched result
  std::size_t rows_per_test = TestRecord::default_capacity;
  std::optional<std::uint64_t>
      component{};  // of several, the checksum of its model: other components' results are left out
  static constexpr std::size_t most_tests = 256;
};

/// Throws Error{write_failed} after Ctrl-C.
void require_not_stopped();

/// Called with the bytes read so far and all bytes.
using ReadingProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Throws Error{file_not_found | bad_input} when it is not a recording, and when stopped.
[[nodiscard]] RecordingContent read_recording(const std::filesystem::path& file, const ReadingProgress& progress,
                                              std::size_t rows_per_test = TestRecord::default_capacity);
/// The same for each of several components, by the checksums of their models. All have the same tests: a record without
/// matched frames where only other components were matched.
[[nodiscard]] std::vector<RecordingContent> read_components(const std::filesystem::path& file,
                                                            std::span<const std::uint64_t> checksums,
                                                            const ReadingProgress& progress, std::size_t rows_per_test);

/// Divides results into tests: the first matched frame of another session, or after the end of its stream, begins
/// another one.
class TestCollector {
 public:
  /// One, or one for each of several components.
  explicit TestCollector(std::span<RecordingContent> contents) : contents_(contents) {}
  void add(const wire::WireResult& result);

 private:
  [[nodiscard]] std::vector<RecordingContent*> concerned(const wire::WireResult& result) const;
  [[nodiscard]] bool begin_test(std::uint64_t session);

  std::span<RecordingContent> contents_;
  std::map<std::uint64_t, std::size_t> current_;  // by session: place in the tests of each
};

/// A frame with its points.
struct RecordedFrame {
  std::optional<wire::WireResult> result;  // none: not recorded
  std::vector<Point> points;               // transformed, at most `most_points` of them; empty: not recorded
  static constexpr std::uint32_t most_points = 20'000;
};

/// The frames with these keys. Of repeated ids, the first one counts. With several `rigs`, whose poses then count, a
/// key is that of a capture, whose frames' points are put together. component: see RecordingContent.
[[nodiscard]] std::map<CaptureKey, RecordedFrame> read_frames(
    const std::filesystem::path& file, std::span<const CaptureKey> wanted, const RigidTransform& T_reference_sensor,
    std::span<const RigSettings> rigs, std::optional<std::uint64_t> component, const ReadingProgress& progress);

}  // namespace lbea::tool
