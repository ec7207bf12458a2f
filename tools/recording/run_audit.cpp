#include "tools/recording/run_audit.hpp"

#include "adapters/recording/recorder_account.hpp"
#include "adapters/wire/codec.hpp"
#include "tools/recording/recorded_run.hpp"
#include "tools/recording/topics.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

namespace lbea {

namespace {

using Kind = RecordedMessage::Kind;

/// Sorted later: a million frames are 16 MB.
using FrameNames = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // session, id

class RunTally {
 public:
  explicit RunTally(RunAudit& audit) : audit_(audit) {}

  void take(const mcap::Message& message, const mcap::Channel* channel) {
    if (channel == nullptr) return;
    const auto carried = channel_of(*channel);
    if (!carried) {
      ++audit_.undecodable;
      return;
    }
    const RecordedMessage recorded = recorded_message(message, *carried);
    if (recorded.kind == Kind::frame) take_frame(recorded);
    if (recorded.kind == Kind::result) take_result(recorded);
    if (recorded.kind == Kind::state) ++audit_.states;
  }

  void close() {
    for (auto& [session, ids] : ids_) close_session(session, ids);
    std::ranges::sort(frames_);
    std::ranges::sort(answers_);
    std::ranges::sort(refused_);
    if (audit_.results > 0) audit_.unanswered = in_first_only(frames_, merged(answers_, refused_));
    audit_.answers_alone = in_first_only(answers_, frames_);
  }

 private:
  void take_frame(const RecordedMessage& frame) {
    audit_.start_ns = audit_.frames == 0 ? frame.log_time_ns : std::min(audit_.start_ns, frame.log_time_ns);
    audit_.end_ns = std::max(audit_.end_ns, frame.log_time_ns);
    ++audit_.frames;
    ids_[frame.session].push_back(frame.id);
    frames_.emplace_back(frame.session, frame.id);
  }
  void take_result(const RecordedMessage& message) {
    ++audit_.results;
    if (decode_result(message.data, result_) != WireStatus::ok) {
      ++audit_.undecodable;
      return;
    }
    ++audit_.results_by_status[std::string(to_string(result_.status))];
    const Fate fate = fate_of(result_.status);
    if (fate == Fate::not_a_capture) ends_[result_.session] = result_.frame_id;
    if (fate == Fate::matched || result_.status == WireStatus::queue_full) answers_.emplace_back(result_.session, result_.frame_id);
    if (fate != Fate::rejected) return;
    refused_.emplace_back(result_.session, result_.frame_id);
    refused_ids_[result_.session].push_back(result_.frame_id);
  }
  void close_session(std::uint64_t id, std::vector<std::uint64_t>& ids) {
    RunAudit::Session& session = audit_.sessions[id];
    const auto end = ends_.find(id);
    session.frames = ids.size();
    std::ranges::sort(ids);
    session.first_id = ids.front();
    session.last_id = ids.back();
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    session.duplicates = session.frames - ids.size();
    if (const auto refused = refused_ids_.find(id); refused != refused_ids_.end()) {  // came, but held no cloud
      ids.insert(ids.end(), refused->second.begin(), refused->second.end());
      std::ranges::sort(ids);
      ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
      session.first_id = std::min(session.first_id, ids.front());
      session.last_id = std::max(session.last_id, ids.back());
    }
    session.ended = end != ends_.end();
    std::uint64_t past_last = session.last_id + 1;
    if (session.ended) past_last = std::max(past_last, end->second);
    session.missing = past_last - session.first_id - ids.size();
  }
  static FrameNames merged(const FrameNames& a, const FrameNames& b) {
    FrameNames both;
    std::ranges::merge(a, b, std::back_inserter(both));
    return both;
  }
  static std::uint64_t in_first_only(const FrameNames& first, const FrameNames& second) {
    FrameNames difference;
    std::ranges::set_difference(first, second, std::back_inserter(difference));
    return difference.size();
  }

  RunAudit& audit_;
  std::map<std::uint64_t, std::vector<std::uint64_t>> ids_, refused_ids_;
  std::map<std::uint64_t, std::uint64_t> ends_;
  FrameNames frames_, answers_, refused_;
  WireResult result_;
};

void read_account(RunAudit& audit, const mcap::Metadata& metadata) {
  audit.has_account = true;
  for (const auto& [key, text] : metadata.texts) {
    std::uint64_t number = 0;
    std::from_chars(text.data(), text.data() + text.size(), number);
    if (key.find("lost") != std::string::npos || key == "failed_syncs") audit.lost += number;
  }
}

template <class Number>
std::uint64_t sum(const std::map<std::uint64_t, RunAudit::Session>& sessions, Number number) {
  std::uint64_t total = 0;
  for (const auto& [id, session] : sessions) total += session.*number;
  return total;
}

}  // namespace

std::uint64_t RunAudit::missing() const noexcept { return sum(sessions, &Session::missing); }
std::uint64_t RunAudit::duplicates() const noexcept { return sum(sessions, &Session::duplicates); }
bool RunAudit::is_complete() const noexcept {
  return file.is_intact() && missing() == 0 && unanswered == 0 && answers_alone == 0 && lost == 0 && undecodable == 0 &&
         (!is_run || has_account);
}

std::vector<std::string> RunAudit::flaws() const {
  std::vector<std::string> flaws;
  const auto say = [&](bool wrong, const std::string& what) {
    if (wrong) flaws.push_back(what);
  };
  say(!file.is_mcap, "does not begin like an MCAP file");
  say(!file.is_closed, "was cut off: it has no end and no index");
  for (const mcap::Gap& gap : file.gaps) say(true, "bytes " + std::to_string(gap.begin) + " to " + std::to_string(gap.end) + ": " + gap.what);
  for (const std::string& complaint : file.complaints) say(true, complaint);
  say(is_run && file.is_closed && !has_account, "the recorder's closing account is missing");
  say(lost > 0, std::to_string(lost) + " messages were lost while recording, as the recorder says");
  say(missing() > 0, std::to_string(missing()) + " frames are missing, as their ids tell");
  say(unanswered > 0, std::to_string(unanswered) + " frames have no result");
  say(answers_alone > 0, std::to_string(answers_alone) + " results are of frames that are not there");
  say(undecodable > 0, std::to_string(undecodable) + " messages cannot be decoded");
  return flaws;
}

RunAudit audit_run(const std::filesystem::path& file) {
  RunAudit audit;
  RunTally tally(audit);
  const mcap::FileSource source(file);
  audit.file = mcap::audit(source, [&](const mcap::Message& message, const mcap::Channel* channel) { tally.take(message, channel); });
  tally.close();
  audit.is_run = audit.file.header.profile == recording_profile;
  for (const mcap::Metadata& metadata : audit.file.metadata) {
    if (metadata.name == settings_metadata_name) audit.settings = settings_from(metadata, source.name());
    if (metadata.name == closing_metadata_name) read_account(audit, metadata);
  }
  return audit;
}

}  // namespace lbea
