// Whether a recording is whole: an undamaged file, every capture of the run, and a result for each frame.
#pragma once

#include "adapters/mcap/salvage.hpp"
#include "tools/shared/recording/recorded_run.hpp"

namespace lbea::tool {

struct RunAudit {
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;  // of the captures known from frames, results and the sender
    std::uint64_t frames = 0;
    std::uint64_t missing = 0;  // captures without a frame
    std::uint64_t duplicates = 0;
    bool ended = false;   // the sender announced its end
    bool silent = false;  // the sender stopped without goodbye
  };
  /// Only what happened around a trigger was recorded. Times are the recorder's.
  struct Window {
    bool triggered = false;
    std::int64_t begin_ns = 0;
    std::uint64_t outside = 0;  // frames received before or after it
  };
  mcap::FileCheck file;
  RunSettings settings;
  bool is_run = false;       // recorded by lbea
  bool is_replayed = false;  // results only, as lbea-replay writes them
  std::map<std::uint64_t, Session> sessions;
  std::uint64_t frames = 0, results = 0, states = 0, undecodable = 0;
  std::uint64_t unanswered = 0;            // frames without a result
  std::uint64_t answers_alone = 0;         // results of matched or dropped frames that were not recorded
  std::uint64_t cut_apart = 0;             // both at the edges of a window, where the counterpart is outside
  std::uint64_t interleaved = 0;           // returns to a sender while the test of another one was running
  std::uint64_t lost = 0;                  // messages that the recorder counted as lost
  bool has_closing_metadata = false;       // the closing metadata are there
  std::optional<wire::Counters> counters;  // of the matcher, from its last message; none without a matcher
  std::optional<Window> window;            // none: everything was recorded
  std::map<std::string, std::uint64_t> results_by_status;
  std::int64_t start_ns = 0, end_ns = 0;  // when the first and the last frame were received

  /// Recorded by the matcher program from start to end, so that its counters describe this recording.
  [[nodiscard]] bool is_matchers_own() const noexcept;
  [[nodiscard]] std::uint64_t missing() const noexcept;
  /// Senders that stopped without goodbye.
  [[nodiscard]] std::uint64_t silent() const noexcept;
  [[nodiscard]] std::uint64_t duplicates() const noexcept;
  /// The file is intact and contains every message that was received and wanted.
  [[nodiscard]] bool holds_all_that_came() const noexcept;
  /// Also nothing of the run is missing.
  [[nodiscard]] bool is_complete() const { return flaws().empty(); }
  /// What is wrong, as sentences; empty for a complete recording.
  [[nodiscard]] std::vector<std::string> flaws() const;
};

/// Gets every sound message of a run, also of a damaged or cut file, in its order.
using RecordedMessageVisitor = std::function<void(const RecordedMessage&)>;

/// Reads the whole file once. Throws Error{file_not_found | bad_input} only when it cannot be read at all.
[[nodiscard]] RunAudit audit_run(const std::filesystem::path& file, const RecordedMessageVisitor& visit = {});

}  // namespace lbea::tool
