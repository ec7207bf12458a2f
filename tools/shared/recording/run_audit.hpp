// Whether a recording holds the whole run: every capture, and an answer to each frame.
#pragma once

#include "adapters/mcap/audit.hpp"
#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/recording/run_settings.hpp"

#include <map>
#include <optional>

namespace lbea::tool {

struct RunAudit {
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;  // of the captures that ids, results or the sender's words tell of
    std::uint64_t frames = 0;
    std::uint64_t missing = 0;  // captures of which there is no frame
    std::uint64_t duplicates = 0;
    bool ended = false;   // the sender said that this was all
    bool silent = false;  // it went without a word
  };
  /// Recorded was what happened around a trigger, in the recorder's time.
  struct Window {
    bool triggered = false;
    std::int64_t begin_ns = 0;
    std::uint64_t outside = 0;  // frames that came before or after it
  };
  mcap::Audit file;
  RunSettings settings;
  bool is_run = false;       // recorded by us
  bool is_replayed = false;  // results only, as lbea-replay writes them
  std::map<std::uint64_t, Session> sessions;
  std::uint64_t frames = 0, results = 0, states = 0, undecodable = 0;
  std::uint64_t unanswered = 0;            // frames without a result
  std::uint64_t answers_alone = 0;         // results of matched or dropped frames that are not there
  std::uint64_t cut_apart = 0;             // the same at a window's edges, where one of the two lies outside
  std::uint64_t lost = 0;                  // what the recorder itself counted as lost
  bool has_account = false;                // it ended the file and said so
  std::optional<wire::Counters> counters;  // of the matcher, as its last message says; none: no matcher was heard
  std::optional<Window> window;            // none: all was recorded
  std::map<std::string, std::uint64_t> results_by_status;
  std::int64_t start_ns = 0, end_ns = 0;  // of the frames, received

  /// Recorded by the matcher itself, from its start to its end: what it counted is about this recording.
  [[nodiscard]] bool is_matchers_own() const noexcept;
  [[nodiscard]] std::uint64_t missing() const noexcept;
  /// Senders that went without goodbye.
  [[nodiscard]] std::uint64_t silent() const noexcept;
  [[nodiscard]] std::uint64_t duplicates() const noexcept;
  /// Intact, and the recorder put into it all that came and was asked for.
  [[nodiscard]] bool holds_all_that_came() const noexcept;
  /// The same, and nothing of the run is missing.
  [[nodiscard]] bool is_complete() const { return flaws().empty(); }
  /// What is wrong, in sentences; empty when it is complete.
  [[nodiscard]] std::vector<std::string> flaws() const;
};

/// Throws Error{file_not_found | bad_input} only when the file cannot be read at all.
[[nodiscard]] RunAudit audit_run(const std::filesystem::path& file);

}  // namespace lbea::tool
