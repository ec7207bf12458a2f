// Whether a recording holds the whole run: every frame that was sent, and an answer to each.
#pragma once

#include "adapters/recording/audit.hpp"
#include "tools/recording/run_settings.hpp"

#include <map>

namespace lbea {

struct RunAudit {
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;
    std::uint64_t frames = 0;
    std::uint64_t missing = 0;     // ids between the first and the last, or before the announced end, that are not there
    std::uint64_t duplicates = 0;
    bool ended = false;            // the sender said that this was all
  };
  mcap::Audit file;
  RunSettings settings;
  bool is_run = false;  // recorded by us
  std::map<std::uint64_t, Session> sessions;
  std::uint64_t frames = 0, results = 0, states = 0, undecodable = 0;
  std::uint64_t unanswered = 0;      // frames without a result
  std::uint64_t answers_alone = 0;   // results of matched or dropped frames that are not there
  std::uint64_t lost = 0;            // what the recorder itself counted as lost
  bool has_account = false;          // it ended the file and said so
  std::map<std::string, std::uint64_t> results_by_status;
  std::int64_t start_ns = 0, end_ns = 0;  // of the frames, received

  [[nodiscard]] std::uint64_t missing() const noexcept;
  [[nodiscard]] std::uint64_t duplicates() const noexcept;
  /// Intact, and nothing of the run is missing.
  [[nodiscard]] bool is_complete() const noexcept;
  /// What is wrong, in sentences; empty when it is complete.
  [[nodiscard]] std::vector<std::string> flaws() const;
};

/// Throws Error{file_not_found | bad_input} only when the file cannot be read at all.
[[nodiscard]] RunAudit audit_run(const std::filesystem::path& file);

}  // namespace lbea
