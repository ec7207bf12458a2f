// Which captures a recording tells of, which of them are in it as frames, and which of these have an answer.
#pragma once

#include "tools/shared/recording/recorded_run.hpp"
#include "tools/shared/recording/run_audit.hpp"

namespace lbea::tool {

class RunTally {
 public:
  explicit RunTally(RunAudit& audit) : audit_(audit) {}
  /// `channel` is null for a message whose channel is not defined.
  void take(const mcap::Message& message, const mcap::Channel* channel);
  /// What a recorder without a matcher said of a sender at its end.
  void know(const wire::WireSender& sender) { sessions_[sender.session].recorders_account = sender; }
  /// After the last message, when the audit knows everything else about the file.
  void close();

 private:
  /// Sorted later: a million frames are 24 MB.
  struct Named {
    std::uint64_t session = 0, id = 0;
    std::int64_t received_ns = 0;
    friend auto operator<=>(const Named& a, const Named& b) noexcept {
      return a.session != b.session ? a.session <=> b.session : a.id <=> b.id;
    }
    friend bool operator==(const Named& a, const Named& b) noexcept { return a.session == b.session && a.id == b.id; }
  };
  struct Captures {
    std::vector<std::uint64_t> frames, refused, absent;  // ids; absent: of which the matcher says that no frame came
    std::optional<std::uint64_t> end;                    // the first id that the sender did not give
    std::optional<wire::WireSender> account;             // the matcher's, the latest
    std::optional<wire::WireSender> recorders_account;
  };

  void take_frame(const RecordedMessage& frame);
  void take_result(const RecordedMessage& message);
  void take_state(const RecordedMessage& message);
  void take_counters(std::uint64_t sequence, const wire::Counters& counters);
  void close_session(std::uint64_t id, Captures& captures);
  void match_answers();
  [[nodiscard]] std::int64_t last_matched_ns() const;

  RunAudit& audit_;
  std::map<std::uint64_t, Captures> sessions_;
  std::vector<Named> frames_, matched_, dropped_, refused_;
  std::uint64_t last_sequence_ = 0;
  std::optional<RunSettings> matcher_;  // the model and method of the first one that was heard
  wire::WireResult result_;
  wire::WireState state_;
};

}  // namespace lbea::tool
